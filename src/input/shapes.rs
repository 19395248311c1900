//! Builds the region that the shapes of a scene describe.

use crate::error::{Error, Result};
use crate::field::{Aabb, Primitive, Shape, Solid, Tree, rotated, surface_of, upright};
use crate::scene::{BallInput, Conversion, CylinderInput, Quantity, ShapeInput, SurfaceInput, orientation, values};
use sph::domain::{Axis, Domain, Hull, Region, Wall};
use sph_formats::{FieldRequest, FileContent, FormatSpec, Unit, UnitDimension};
use std::sync::Arc;

/// The solid of a shape that stands at `key`, with notes.
///
/// # Errors
/// Numbers that make no shape, coordinates of another dimension, files that cannot be read, solids that are endless or empty.
pub(crate) fn solid<const D: usize>(
    shape: &ShapeInput,
    key: &str,
    formats: &[FormatSpec],
    conversion: &Conversion,
) -> Result<(Solid<D>, Vec<String>)> {
    let Made { primitives, tree, bounds, notes } = made(shape, key, formats, conversion)?;
    let key = format!("{key}.{}", shape.name());
    if let Some(k) = (0..D).find(|&k| !(bounds.lo[k].is_finite() && bounds.hi[k].is_finite())) {
        let problem = format!("has no end along {}; intersect it with a box", ["x", "y", "z"][k]);
        return Err(Error::scene(key, problem));
    }
    if (0..D).any(|k| !(bounds.hi[k] > bounds.lo[k])) {
        return Err(Error::scene(key, "is empty: its parts do not overlap"));
    }
    let solid = Solid::new(primitives, tree, bounds).map_err(|problem| Error::scene(key, problem))?;
    Ok((solid, notes))
}

/// The domain within a shape, whose surface is a wall of a kind.
///
/// # Errors
/// As for [`solid`].
pub(crate) fn domain<const D: usize>(
    shape: &ShapeInput,
    formats: &[FormatSpec],
    (wall, conversion): (Wall, &Conversion),
    notes: &mut Vec<String>,
) -> Result<Domain<D>> {
    let (solid, found) = solid::<D>(shape, "domain", formats, conversion)?;
    notes.extend(found);
    let ([lo, hi], volume) = (solid.bounds(), solid.volume_estimate());
    let size = ["length", "area", "volume"][D - 1];
    notes.push(format!("{size} of the domain {:.9e}, known to {:.1e}", volume.value, volume.error / volume.value));
    let hull: Arc<dyn Hull<D>> = Arc::new(solid);
    Ok(Domain::new(lo, hi, [Axis::OPEN; D], Region::Hull(hull, wall))?)
}

/// Whether places are in a shape, which may be endless.
///
/// # Errors
/// As for [`solid`], but for those of its extent.
pub(crate) fn inside<const D: usize>(
    shape: &ShapeInput,
    key: &str,
    formats: &[FormatSpec],
    conversion: &Conversion,
) -> Result<impl Fn(&[f64; D]) -> bool + use<D>> {
    let Made { primitives, tree, .. } = made(shape, key, formats, conversion)?;
    Ok(move |x: &[f64; D]| tree.contains(&|i| primitives[i].contains(x)))
}

/// Primitives, what makes one of them, and a box around it.
struct Made<const D: usize> {
    primitives: Vec<Primitive<D>>,
    tree: Tree,
    bounds: Aabb<D>,
    notes: Vec<String>,
}

fn made<const D: usize>(
    shape: &ShapeInput,
    key: &str,
    formats: &[FormatSpec],
    conversion: &Conversion,
) -> Result<Made<D>> {
    let mut maker = Maker { primitives: Vec::new(), formats, conversion, notes: Vec::new() };
    let (tree, bounds) = maker.make(shape, key, &Frame::UPRIGHT)?;
    let Maker { primitives, notes, .. } = maker;
    Ok(Made { primitives, tree, bounds, notes })
}

/// How shapes are turned: x becomes about + turn (x - about), for each in its order.
#[derive(Clone)]
struct Frame<const D: usize> {
    axes: [[f64; D]; D],
    shift: [f64; D],
}

impl<const D: usize> Frame<D> {
    const UPRIGHT: Self = Self { axes: const { unit_axes() }, shift: [0.0; D] };

    fn place(&self, x: &[f64; D]) -> [f64; D] {
        let turned = self.direction(x);
        sph::array(|k| turned[k] + self.shift[k])
    }

    fn direction(&self, x: &[f64; D]) -> [f64; D] {
        sph::array(|k| (0..D).map(|i| self.axes[i][k] * x[i]).sum())
    }

    /// First turned by `degrees` about a point, then as this.
    fn after(&self, degrees: &[f64; 3], about: &[f64; D]) -> Self {
        let axes: [[f64; D]; D] = std::array::from_fn(|i| {
            let unit: [f64; 3] = sph::array(|k| f64::from(u8::from(i == k)));
            let turned = rotated(degrees, &unit);
            self.direction(&sph::array(|k| turned[k]))
        });
        let all = Self { axes, shift: [0.0; D] };
        let (there, here) = (self.place(about), all.place(about));
        Self { shift: sph::array(|k| there[k] - here[k]), ..all }
    }
}

const fn unit_axes<const D: usize>() -> [[f64; D]; D] {
    let mut axes = [[0.0; D]; D];
    let mut k = 0;
    while k < D {
        axes[k][k] = 1.0;
        k += 1;
    }
    axes
}

struct Maker<'a, const D: usize> {
    primitives: Vec<Primitive<D>>,
    formats: &'a [FormatSpec],
    conversion: &'a Conversion,
    notes: Vec<String>,
}

impl<const D: usize> Maker<'_, D> {
    fn make(&mut self, shape: &ShapeInput, key: &str, frame: &Frame<D>) -> Result<(Tree, Aabb<D>)> {
        let key = format!("{key}.{}", shape.name());
        match shape {
            ShapeInput::Box([lo, hi]) => {
                let (lo, hi) = (self.point(&key, lo, false)?, self.point(&key, hi, false)?);
                if let Some(k) = (0..D).find(|&k| !(hi[k] > lo[k])) {
                    let problem =
                        format!("runs from {} to {} along axis {k}, expected the second to be larger", lo[k], hi[k]);
                    return Err(Error::scene(key, problem));
                }
                Ok(self.cuboid(&lo, &hi, frame))
            }
            ShapeInput::Ball(ball) => self.ball(ball, &key, frame),
            ShapeInput::Cylinder(cylinder) => self.cylinder(cylinder, &key, frame),
            ShapeInput::Torus(torus) => {
                self.only_in_space(&key)?;
                let center = self.point(&format!("{key}.center"), &torus.center, true)?;
                let radius = self.length(&format!("{key}.radius"), &torus.radius)?;
                let tube = self.length(&format!("{key}.tube_radius"), &torus.tube_radius)?;
                if tube > radius {
                    let problem = format!("is {tube}, expected at most the radius {radius}");
                    return Err(Error::scene(format!("{key}.tube_radius"), problem));
                }
                let about = turned_to::<D>(torus.axis as usize);
                let reach = |k: usize| if k == torus.axis as usize { tube } else { radius + tube };
                let bounds = self.around(&center, &sph::array(reach), frame);
                Ok((self.leaf(Shape::Torus { radius, tube }, &center, &about, frame), bounds))
            }
            ShapeInput::Ellipsoid(ellipsoid) => {
                let center = self.point(&format!("{key}.center"), &ellipsoid.center, true)?;
                let radii = self.point(&format!("{key}.radii"), &ellipsoid.radii, false)?;
                if let Some(r) = radii.iter().find(|r| !(**r > 0.0)) {
                    return Err(Error::scene(format!("{key}.radii"), format!("has {r}, expected more than 0")));
                }
                let bounds = self.around(&center, &radii, frame);
                Ok((self.leaf(Shape::Ellipsoid { radii }, &center, &upright(), frame), bounds))
            }
            ShapeInput::HalfSpace(half) => {
                let point = self.point(&format!("{key}.point"), &half.point, true)?;
                let normal: [f64; D] = half.normal.as_slice().try_into().map_err(|_| {
                    let problem = format!("has {} components, expected {D}", half.normal.len());
                    Error::scene(format!("{key}.normal"), problem)
                })?;
                Ok(self.half_space(&point, &normal, frame))
            }
            ShapeInput::Surface(surface) => self.surface(surface, &key, frame),
            ShapeInput::Union(parts) => {
                let (trees, boxes) = self.all(parts, &key, frame)?;
                Ok((Tree::Any(trees), boxes.into_iter().reduce(joined).unwrap_or(Aabb::EMPTY)))
            }
            ShapeInput::Intersection(parts) => {
                let (trees, boxes) = self.all(parts, &key, frame)?;
                Ok((Tree::All(trees), boxes.into_iter().reduce(common).unwrap_or(Aabb::EMPTY)))
            }
            ShapeInput::Difference(parts) => {
                let (mut trees, boxes) = self.all(parts, &key, frame)?;
                let first = trees.remove(0);
                Ok((Tree::Less(Box::new(first), trees), boxes.first().copied().unwrap_or(Aabb::EMPTY)))
            }
            ShapeInput::Rotate(rotate) => {
                let about = self.point(&format!("{key}.about"), &rotate.about, true)?;
                let degrees = orientation(&[], &rotate.by).rotate;
                if D == 1 || (D == 2 && (degrees[0] != 0.0 || degrees[1] != 0.0)) {
                    let problem = format!("is {:?}, which leads out of {D} dimension(s)", rotate.by);
                    return Err(Error::scene(format!("{key}.by"), problem));
                }
                self.make(&rotate.shape, &key, &frame.after(&degrees, &about))
            }
        }
    }

    fn all(&mut self, parts: &[ShapeInput], key: &str, frame: &Frame<D>) -> Result<(Vec<Tree>, Vec<Aabb<D>>)> {
        let made = parts.iter().map(|part| self.make(part, key, frame)).collect::<Result<Vec<_>>>()?;
        Ok(made.into_iter().unzip())
    }

    fn only_in_space(&self, key: &str) -> Result<()> {
        if D == 3 { Ok(()) } else { Err(Error::scene(key, format!("exists in 3 dimensions, but the scene has {D}"))) }
    }

    /// A primitive: `own` are its axes before it is turned by `frame`.
    fn leaf(&mut self, shape: Shape<D>, center: &[f64; D], own: &[[f64; D]; D], frame: &Frame<D>) -> Tree {
        let axes = std::array::from_fn(|i| frame.direction(&own[i]));
        self.primitives.push(Primitive { shape, center: frame.place(center), frame: axes });
        Tree::Leaf(self.primitives.len() - 1)
    }

    fn ball(&mut self, ball: &BallInput, key: &str, frame: &Frame<D>) -> Result<(Tree, Aabb<D>)> {
        let center = self.point(&format!("{key}.center"), &ball.center, true)?;
        let radius = self.length(&format!("{key}.radius"), &ball.radius)?;
        let bounds = self.around(&center, &[radius; D], frame);
        let outer = self.leaf(Shape::Ellipsoid { radii: [radius; D] }, &center, &upright(), frame);
        let Some(inner) = self.inner(&format!("{key}.inner_radius"), &ball.inner_radius, radius)? else {
            return Ok((outer, bounds));
        };
        let hollow = self.leaf(Shape::Ellipsoid { radii: [inner; D] }, &center, &upright(), frame);
        Ok((Tree::Less(Box::new(outer), vec![hollow]), bounds))
    }

    fn cylinder(&mut self, cylinder: &CylinderInput, key: &str, frame: &Frame<D>) -> Result<(Tree, Aabb<D>)> {
        self.only_in_space(key)?;
        let center = self.point(&format!("{key}.center"), &cylinder.center, true)?;
        let radius = self.length(&format!("{key}.radius"), &cylinder.radius)?;
        let length = self.length(&format!("{key}.length"), &cylinder.length)?;
        let axis = cylinder.axis as usize;
        let own = turned_to::<D>(axis);
        let reach = |k: usize| if k == axis { 0.5 * length } else { radius };
        let bounds = self.around(&center, &sph::array(reach), frame);
        let mut parts = vec![self.leaf(Shape::Cylinder { radius }, &center, &own, frame)];
        for sign in [1.0, -1.0] {
            let normal: [f64; D] = sph::array(|k| if k == axis { sign } else { 0.0 });
            let end: [f64; D] = sph::array(|k| center[k] + 0.5 * length * normal[k]);
            parts.push(self.half_space(&end, &normal, frame).0);
        }
        let whole = Tree::All(parts);
        let Some(inner) = self.inner(&format!("{key}.inner_radius"), &cylinder.inner_radius, radius)? else {
            return Ok((whole, bounds));
        };
        let hollow = self.leaf(Shape::Cylinder { radius: inner }, &center, &own, frame);
        Ok((Tree::Less(Box::new(whole), vec![hollow]), bounds))
    }

    fn cuboid(&mut self, lo: &[f64; D], hi: &[f64; D], frame: &Frame<D>) -> (Tree, Aabb<D>) {
        let faces = (0..2 * D).map(|face| {
            let (k, corner, sign) = if face < D { (face, lo, -1.0) } else { (face - D, hi, 1.0) };
            self.half_space(corner, &sph::array(|i| if i == k { sign } else { 0.0 }), frame).0
        });
        let tree = Tree::All(faces.collect());
        let middle = sph::array(|k| 0.5 * (lo[k] + hi[k]));
        (tree, self.around(&middle, &sph::array(|k| 0.5 * (hi[k] - lo[k])), frame))
    }

    fn half_space(&mut self, point: &[f64; D], normal: &[f64; D], frame: &Frame<D>) -> (Tree, Aabb<D>) {
        let size = normal.iter().fold(0.0_f64, |m, c| m.max(c.abs()));
        let scaled = normal.map(|c| c / size);
        let length = scaled.iter().map(|c| c * c).sum::<f64>().sqrt();
        let outward = frame.direction(&scaled.map(|c| c / length));
        let center = frame.place(point);
        let mut bounds = Aabb { lo: [f64::NEG_INFINITY; D], hi: [f64::INFINITY; D] };
        if let Some(k) = (0..D).find(|&k| (0..D).all(|i| i == k || outward[i].abs() < 1e-15)) {
            if outward[k] > 0.0 { bounds.hi[k] = center[k] } else { bounds.lo[k] = center[k] }
        }
        self.primitives.push(Primitive { shape: Shape::HalfSpace { normal: outward }, center, frame: upright() });
        (Tree::Leaf(self.primitives.len() - 1), bounds)
    }

    fn surface(&mut self, input: &SurfaceInput, key: &str, frame: &Frame<D>) -> Result<(Tree, Aabb<D>)> {
        if frame.axes != upright() || frame.shift != [0.0; D] {
            return Err(Error::scene(key, "cannot be part of `rotate`; turn it by its own key `rotate`"));
        }
        let content = sph_formats::read(self.formats, &input.file, input.format.as_deref(), &FieldRequest::default())?;
        let FileContent::Field(field) = content else {
            return Err(Error::scene(format!("{key}.file"), "holds particles, expected a surface (STL, OBJ, PLY)"));
        };
        let mut placed = orientation(&input.scale, &input.rotate);
        let unit = match input.length_unit.as_deref() {
            None => self.conversion.factor(UnitDimension::LENGTH),
            Some(name) => {
                let known = Unit::parse(name)
                    .filter(|u| u.dimension == UnitDimension::LENGTH && self.conversion.from.is_some());
                known.map(|u| u.to_cgs / self.conversion.to.length).ok_or_else(|| {
                    let problem = format!(
                        "is '{name}', expected a unit of length such as km, in a scene whose `units` are stated"
                    );
                    Error::scene(format!("{key}.length_unit"), problem)
                })?
            }
        };
        placed.scale = placed.scale.map(|s| s * unit);
        let (surface, notes) = surface_of::<D>(&input.file, field.geometry, &placed)?;
        self.notes.extend(field.notes.into_iter().chain(notes));
        let [lo, hi] = surface.bounds();
        Ok((self.leaf(Shape::Surface(Arc::new(surface)), &[0.0; D], &upright(), frame), Aabb { lo, hi }))
    }

    /// A box around one with these half edges that is turned.
    fn around(&self, center: &[f64; D], half: &[f64; D], frame: &Frame<D>) -> Aabb<D> {
        let middle = frame.place(center);
        let reach = |k: usize| (0..D).map(|i| (frame.axes[i][k] * half[i]).abs()).sum::<f64>();
        Aabb { lo: sph::array(|k| middle[k] - reach(k)), hi: sph::array(|k| middle[k] + reach(k)) }
    }

    fn length(&self, key: &str, quantity: &Quantity) -> Result<f64> {
        quantity.check_positive(key, UnitDimension::LENGTH)?;
        quantity.value(key, UnitDimension::LENGTH, self.conversion)
    }

    /// An inner radius, if there is one.
    fn inner(&self, key: &str, quantity: &Quantity, outer: f64) -> Result<Option<f64>> {
        let inner = quantity.value(key, UnitDimension::LENGTH, self.conversion)?;
        if !(inner >= 0.0 && inner < outer) {
            return Err(Error::scene(key, format!("is {inner}, expected 0 to less than the radius {outer}")));
        }
        Ok(Some(inner).filter(|r| *r > 0.0))
    }

    /// As many coordinates as dimensions; zeros where they may be left out.
    fn point(&self, key: &str, coordinates: &[Quantity], may_be_missing: bool) -> Result<[f64; D]> {
        let found = values(key, coordinates, UnitDimension::LENGTH, self.conversion)?;
        if found.is_empty() && may_be_missing {
            return Ok([0.0; D]);
        }
        let count = found.len();
        found.try_into().map_err(|_| Error::scene(key, format!("has {count} coordinates, expected {D}")))
    }
}

/// Axes of which the last is the coordinate axis `axis`.
fn turned_to<const D: usize>(axis: usize) -> [[f64; D]; D] {
    let all = upright::<D>();
    std::array::from_fn(|i| all[(axis + 1 + i) % D])
}

fn joined<const D: usize>(a: Aabb<D>, b: Aabb<D>) -> Aabb<D> {
    Aabb { lo: sph::array(|k| a.lo[k].min(b.lo[k])), hi: sph::array(|k| a.hi[k].max(b.hi[k])) }
}

fn common<const D: usize>(a: Aabb<D>, b: Aabb<D>) -> Aabb<D> {
    Aabb { lo: sph::array(|k| a.lo[k].max(b.lo[k])), hi: sph::array(|k| a.hi[k].min(b.hi[k])) }
}
