//! Shapes of geoms, and the mass that they give to their bodies.

use std::collections::HashMap;
use std::f64::consts::PI;

use supple_text::FileError;

use super::super::sdf::check_position;
use super::super::solids::drawn;
use super::super::words::shown;
use super::super::xml::Element;
use super::defaults::Values;
use super::orientation::{between, pose};
use super::reader::Reader;
use crate::{Pose, Primitive, Solid as Drawn, Wall, WallShape};

/// The last group of geoms that MuJoCo shows by default. Collision shapes are often in later groups.
const LAST_SHOWN: f64 = 2.0;
/// Default density, kg/m^3: that of water.
const DENSITY: f64 = 1000.0;
/// Words for a flag that is true or false.
const TRUTH: [(&str, bool); 2] = [("true", true), ("false", false)];

/// The shape of a geom.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Shape {
    Sphere,
    Capsule,
    Cylinder,
    Ellipsoid,
    Box,
    /// A plane, which has no mass.
    Plane,
    /// A shape given by a mesh file or a height field.
    Mesh,
}

/// Names of the shapes.
const SHAPES: [(&str, Shape); 9] = [
    ("sphere", Shape::Sphere),
    ("capsule", Shape::Capsule),
    ("cylinder", Shape::Cylinder),
    ("ellipsoid", Shape::Ellipsoid),
    ("box", Shape::Box),
    ("plane", Shape::Plane),
    ("mesh", Shape::Mesh),
    ("sdf", Shape::Mesh),
    ("hfield", Shape::Mesh),
];

/// A rigid body about its centre of mass.
pub(super) struct Solid {
    /// Mass, kg.
    pub(super) mass: f64,
    /// Its principal axes in the body, at its centre of mass.
    pub(super) pose: Pose,
    /// Moments of inertia about these axes, kg m^2.
    pub(super) moments: [f64; 3],
}

/// The mass that a geom contributes to its body.
pub(super) enum Mass {
    None,
    Known(Solid),
    /// From a mesh, which is not read.
    OfMesh,
}

impl<'a> Reader<'a, '_> {
    /// The mass of a geom in `frame` of a body whose elements are of `class`.
    ///
    /// # Errors
    /// If its numbers are invalid.
    pub(super) fn solid(&self, at: Element<'a>, frame: &Pose, class: usize) -> Result<Mass, FileError> {
        let values = self.classes.values(at, "geom", class)?;
        let [first, last] = self.settings.groups;
        let group = values.number("group")?.unwrap_or(0.0);
        let mass = least_zero(&values, "mass")?;
        let density = least_zero(&values, "density")?.unwrap_or(DENSITY);
        if !(first <= group && group <= last) || mass.unwrap_or(density) == 0.0 {
            return Ok(Mass::None);
        }
        let shape = values.choice("type", &SHAPES)?.unwrap_or(Shape::Sphere);
        match shape {
            Shape::Plane => return Ok(Mass::None),
            Shape::Mesh => return Ok(Mass::OfMesh),
            // A shape fitted to a mesh.
            _ if values.text("mesh").is_some() => return Ok(Mass::OfMesh),
            _ => {}
        }
        if values.choice("shellinertia", &TRUTH)? == Some(true) {
            let message = "the inertia of shells is not computed";
            return Err(values.error("shellinertia", message).with_help("give the body an `inertial`"));
        }
        let (size, placed) = self.placed(&values, shape)?;
        let needed = match shape {
            Shape::Sphere => 1,
            Shape::Capsule | Shape::Cylinder => 2,
            _ => 3,
        };
        check_sizes(&values, size, needed)?;
        let mass = mass.unwrap_or(density * volume(shape, size));
        Ok(Mass::Known(Solid { mass, pose: frame.compose(&placed), moments: moments(shape, size, mass) }))
    }

    /// Sizes of a geom, m, and where it is in its body or frame.
    ///
    /// # Errors
    /// Where its place is given twice, or not valid.
    fn placed(&self, values: &Values, shape: Shape) -> Result<([f64; 3], Pose), FileError> {
        let mut size = values.sizes()?;
        let placed = match between(values)? {
            Some((placed, half)) => {
                match shape {
                    Shape::Sphere => {
                        let message = "`fromto` requires a `capsule`, `cylinder`, `box` or `ellipsoid`; found `sphere`";
                        return Err(values.error("fromto", message));
                    }
                    Shape::Box | Shape::Ellipsoid => (size[1], size[2]) = (size[0], half),
                    _ => size[1] = half,
                }
                placed
            }
            None => pose(values, self.settings)?,
        };
        Ok((size, placed))
    }

    /// The visual shape of a geom in `frame` of its body; `None` if it is a mesh or a plane, or does not show.
    ///
    /// # Errors
    /// If its numbers are invalid.
    pub(super) fn primitive(
        &mut self,
        at: Element<'a>,
        frame: &Pose,
        class: usize,
    ) -> Result<Option<Primitive>, FileError> {
        let values = self.classes.values(at, "geom", class)?;
        let shape = values.choice("type", &SHAPES)?.unwrap_or(Shape::Sphere);
        if matches!(shape, Shape::Plane | Shape::Mesh) || values.text("mesh").is_some() || !is_shown(&values)? {
            return Ok(None);
        }
        let (size, placed) = self.placed(&values, shape)?;
        let ([radius, half, _], whole) = (size, size.map(|half| 2.0 * half));
        let solid = match shape {
            Shape::Sphere => Drawn::Sphere { radius },
            Shape::Capsule => Drawn::Capsule { radius, length: 2.0 * half },
            Shape::Cylinder => Drawn::Cylinder { radius, length: 2.0 * half },
            Shape::Ellipsoid => Drawn::Ellipsoid { radii: size },
            Shape::Box | Shape::Plane | Shape::Mesh => Drawn::Box { size: whole },
        };
        let solid = drawn(at, Ok(Some(solid)), &mut self.parts.warnings);
        Ok(solid.map(|solid| Primitive { solid, pose: frame.compose(&placed) }))
    }

    /// Keeps a named plane or box as a wall; `world` is the pose of its body or frame, which does not move.
    ///
    /// # Errors
    /// Where its sizes or its place are not valid.
    pub(super) fn wall(&mut self, at: Element<'a>, world: &Pose, class: usize) -> Result<(), FileError> {
        let Some(name) = at.attribute("name").filter(|name| !name.is_empty()) else { return Ok(()) };
        let values = self.classes.values(at, "geom", class)?;
        let shape = values.choice("type", &SHAPES)?.unwrap_or(Shape::Sphere);
        if !matches!(shape, Shape::Plane | Shape::Box) || values.text("mesh").is_some() {
            return Ok(());
        }
        let (size, placed) = self.placed(&values, shape)?;
        let shape = if shape == Shape::Plane { WallShape::Plane } else { WallShape::Box(size) };
        if shape != WallShape::Plane {
            check_sizes(&values, size, 3)?;
        }
        let pose = world.compose(&placed);
        check_position(at, &pose)?;
        self.walls.push(Wall { name: name.to_owned(), shape, pose, line: at.line() });
        Ok(())
    }

    /// # Errors
    /// Where two walls have one name.
    pub(super) fn check_walls(&self, root: Element<'a>) -> Result<(), FileError> {
        let mut lines = HashMap::new();
        for wall in &self.walls {
            if let Some(first) = lines.insert(wall.name.as_str(), wall.line) {
                let message = format!("there are two geoms {}, at lines {first} and {}", shown(&wall.name), wall.line);
                return Err(root.error_naming(&wall.name, message));
            }
        }
        Ok(())
    }
}

/// Whether a viewer shows a geom: by its group, and its opacity.
///
/// # Errors
/// If these are not valid.
pub(super) fn is_shown(values: &Values) -> Result<bool, FileError> {
    let hidden = values.number("group")?.unwrap_or(0.0) > LAST_SHOWN;
    let clear = values.list("rgba")?.is_some_and(|rgba| rgba.get(3) == Some(&0.0));
    Ok(!(hidden || clear))
}

/// # Errors
/// Where one of the first sizes is not positive.
fn check_sizes(values: &Values, size: [f64; 3], needed: usize) -> Result<(), FileError> {
    match size.iter().take(needed).position(|&size| size <= 0.0) {
        None => Ok(()),
        Some(i) => {
            let message = format!("number {} of `size` must be positive; found {}", i + 1, size[i]);
            Err(values.error("size", message))
        }
    }
}

/// A number that is at least 0.
fn least_zero(values: &Values, name: &'static str) -> Result<Option<f64>, FileError> {
    match values.number(name)? {
        Some(number) if number < 0.0 => Err(values.error(name, format!("`{name}` must be at least 0; found {number}"))),
        number => Ok(number),
    }
}

/// The volume of a shape, m^3. Sizes are radii and half lengths, m; that of a capsule excludes its caps.
fn volume(shape: Shape, [a, b, c]: [f64; 3]) -> f64 {
    match shape {
        Shape::Sphere => 4.0 / 3.0 * PI * a * a * a,
        Shape::Capsule => PI * a * a * (2.0 * b + 4.0 / 3.0 * a),
        Shape::Cylinder => PI * a * a * 2.0 * b,
        Shape::Ellipsoid => 4.0 / 3.0 * PI * a * b * c,
        Shape::Box => 8.0 * a * b * c,
        Shape::Plane | Shape::Mesh => 0.0,
    }
}

/// The moments of inertia of a homogeneous shape about its axes, kg m^2; z is the long axis.
fn moments(shape: Shape, [a, b, c]: [f64; 3], mass: f64) -> [f64; 3] {
    match shape {
        Shape::Sphere => [0.4 * mass * a * a; 3],
        Shape::Capsule => {
            // A cylinder of length h, and a sphere in halves at its ends: m_s / m = (4 a / 3) / (4 a / 3 + h).
            let h = 2.0 * b;
            let sphere = mass * 4.0 * a / (4.0 * a + 3.0 * h);
            let cylinder = mass - sphere;
            let across =
                cylinder * (3.0 * a * a + h * h) / 12.0 + sphere * (0.4 * a * a + h * (3.0 * a + 2.0 * h) / 8.0);
            [across, across, 0.5 * cylinder * a * a + 0.4 * sphere * a * a]
        }
        Shape::Cylinder => {
            let across = mass * (3.0 * a * a + 4.0 * b * b) / 12.0;
            [across, across, 0.5 * mass * a * a]
        }
        Shape::Ellipsoid => [b * b + c * c, a * a + c * c, a * a + b * b].map(|sum| mass * sum / 5.0),
        Shape::Box => [b * b + c * c, a * a + c * c, a * a + b * b].map(|sum| mass * sum / 3.0),
        Shape::Plane | Shape::Mesh => [0.0; 3],
    }
}
