//! Sums that do not depend on threads and lose nothing to rounding.

use sph_core::reduce::sum;

#[test]
fn sums_keep_small_terms_beside_large_ones() {
    let terms = [1e16, 1.0, -1e16, 1.0];
    assert_eq!(sum(terms.len(), |i| terms[i]), 2.0);
    assert_eq!(sum(1_000_000, |_| 0.1), 100_000.0);
}
