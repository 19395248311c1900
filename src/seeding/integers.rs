//! Integer vectors: linear equations in them, and the cosets of a lattice in Z^d.

pub(super) type Vector = [i64; 3];

/// (g, p, q) with g = gcd(a, b) >= 0 and p a + q b = g, by Euclid's algorithm; |p| and |q| stay below |b| and |a|.
fn bezout(a: i64, b: i64) -> (i64, i64, i64) {
    let (mut now, mut next) = ((a, 1, 0), (b, 0, 1));
    while next.0 != 0 {
        let times = now.0 / next.0;
        (now, next) = (next, (now.0 - times * next.0, now.1 - times * next.1, now.2 - times * next.2));
    }
    if now.0 < 0 { (-now.0, -now.1, -now.2) } else { now }
}

pub(super) fn gcd(a: i64, b: i64) -> i64 {
    let (mut a, mut b) = (a.abs(), b.abs());
    while b != 0 {
        (a, b) = (b, a % b);
    }
    a
}

/// All solutions x of n . x = gcd(n) are `particular` plus integer multiples of the two of `kernel`.
pub(super) struct Solutions {
    pub gcd: i64,
    pub particular: Vector,
    pub kernel: [Vector; 2],
}

/// Solves n . x = gcd(n) for n other than 0.
pub(super) fn solve(n: Vector) -> Solutions {
    let (first, p, q) = bezout(n[0], n[1]);
    let (gcd, r, t) = bezout(first, n[2]);
    if first == 0 {
        return Solutions { gcd, particular: [0, 0, t], kernel: [[1, 0, 0], [0, 1, 0]] };
    }
    let kernel = [[n[1] / first, -n[0] / first, 0], [p * (n[2] / gcd), q * (n[2] / gcd), -first / gcd]];
    Solutions { gcd, particular: [r * p, r * q, t], kernel }
}

/// Solves a0 x1 - a1 x0 = gcd(a): the vectors that span the least area with `a`, which differ by multiples of a/gcd.
pub(super) fn solve_in_plane(a: [i64; 2]) -> (i64, [i64; 2]) {
    let (gcd, p, q) = bezout(a[0], a[1]);
    (gcd, [-q, p])
}

pub(super) fn cross(a: &Vector, b: &Vector) -> Vector {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}

/// The diagonal d of the Hermite normal form of the matrix with these columns: the points with 0 <= m_k < d_k are one of each
/// coset of the lattice that the columns span (Cohen 1993, A Course in Computational Algebraic Number Theory, sec. 2.4).
pub(super) fn hermite_diagonal<const D: usize>(columns: [[i64; D]; D]) -> [i64; D] {
    let mut columns = columns.map(|c| c.map(i128::from));
    for row in 0..D {
        for other in row + 1..D {
            while columns[other][row] != 0 {
                let times = columns[row][row] / columns[other][row];
                for k in row..D {
                    columns[row][k] -= times * columns[other][k];
                }
                columns.swap(row, other);
            }
        }
    }
    sph::array(|k| columns[k][k].unsigned_abs() as i64)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn dot(a: Vector, b: Vector) -> i64 {
        (0..3).map(|k| a[k] * b[k]).sum()
    }

    #[test]
    fn equations_are_solved_with_all_their_solutions() {
        for n in [[6, 10, 15], [0, 0, -7], [0, 4, 6], [5, 0, 0], [-12, 18, 30], [1, 0, 3], [99_991, 46_367, -31_111]] {
            let Solutions { gcd: g, particular, kernel } = solve(n);
            assert_eq!(g, n.iter().fold(0, |g, &v| gcd(g, v)), "{n:?}");
            assert_eq!(dot(n, particular), g, "{n:?}");
            assert!(kernel.iter().all(|k| dot(n, *k) == 0), "{n:?}");
            // They span the whole plane: their cross product is n up to its divisor.
            let normal = cross(&kernel[0], &kernel[1]);
            assert!(normal == n.map(|v| v / g) || normal == n.map(|v| -v / g), "{n:?}: {normal:?}");
        }
        for a in [[3, 5], [0, 4], [-6, 4], [7, 0]] {
            let (g, x) = solve_in_plane(a);
            assert_eq!((a[0] * x[1] - a[1] * x[0], g), (g, gcd(a[0], a[1])), "{a:?}");
        }
    }

    #[test]
    fn diagonals_multiply_to_the_determinant() {
        assert_eq!(hermite_diagonal([[2, 0], [1, 3]]).iter().product::<i64>(), 6);
        let columns = [[3, -1, 4], [1, 5, -9], [2, 6, 5]];
        let determinant: i64 = dot(cross(&columns[0], &columns[1]), columns[2]);
        assert_eq!(hermite_diagonal(columns).iter().product::<i64>(), determinant.abs());
    }
}
