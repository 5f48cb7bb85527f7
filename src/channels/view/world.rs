//! Geometry of pictures: places in the world frame, in the unit of length of the recording.
//!
//! Everything else under `/view` computes in R: lengths are scaled here and nowhere else. In a dimensionless recording
//! the scale is 1.

use crate::{
    message::foxglove::{self, Color, LinePrimitive, Point3, Pose, Quaternion, Vector3, line_primitive},
    units::Unit,
};

/// Makes geometry from lengths in R.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct World {
    pub unit: Unit,
}

impl World {
    /// Deformed surface and backing.
    pub const SURFACE: Color = Self::opaque(0.0, 0.45, 0.70);
    pub const OUTLINE: Color = Self::opaque(0.35, 0.35, 0.35);
    pub const BODY: Color = Self::opaque(0.62, 0.62, 0.62);
    pub const DRAG: Color = Self::opaque(0.84, 0.37, 0.0);
    pub const CONTACT: Color = Self::opaque(0.0, 0.62, 0.45);
    pub const FRONT: Color = Self::opaque(0.90, 0.62, 0.0);

    /// A colour of a scene.
    pub const fn opaque(r: f64, g: f64, b: f64) -> Color {
        Color { r, g, b, a: 1.0 }
    }

    /// A length in the unit of the recording.
    pub fn length(self, length: f64) -> f64 {
        self.unit.of(length)
    }

    /// A vector in the plane of the field.
    pub fn vector(self, x: f64, y: f64) -> Vector3 {
        Vector3 { x: self.length(x), y: self.length(y), z: 0.0 }
    }

    pub fn square(self, edge: f64) -> foxglove::Vector2 {
        foxglove::Vector2 { x: self.length(edge), y: self.length(edge) }
    }

    /// A point in the plane of the field.
    pub fn point(self, x: f64, y: f64) -> Point3 {
        Point3 { x: self.length(x), y: self.length(y), z: 0.0 }
    }

    /// A point rounded to single precision: half of its bytes are zeros, which compress well.
    pub fn rounded(self, x: f64, y: f64) -> Point3 {
        let Point3 { x, y, z } = self.point(x, y);
        Point3 { x: f64::from(x as f32), y: f64::from(y as f32), z }
    }

    /// A pose without rotation at a height above the plane of the field.
    pub fn at(self, x: f64, y: f64, z: f64) -> Pose {
        self.turned(x, y, z, UPRIGHT)
    }

    /// A pose at a height above the plane of the field.
    pub fn turned(self, x: f64, y: f64, z: f64, orientation: Quaternion) -> Pose {
        let position = Vector3 { z: self.length(z), ..self.vector(x, y) };
        Pose { position: Some(position), orientation: Some(orientation) }
    }

    /// A line two pixels thick through points, at a height above the plane of the field.
    pub fn line(self, points: Vec<Point3>, z: f64, colour: Color) -> LinePrimitive {
        LinePrimitive {
            r#type: line_primitive::Type::LineStrip.into(),
            pose: Some(self.at(0.0, 0.0, z)),
            thickness: 2.0,
            scale_invariant: true,
            points,
            color: Some(colour),
            ..LinePrimitive::default()
        }
    }
}

pub const UPRIGHT: Quaternion = Quaternion { x: 0.0, y: 0.0, z: 0.0, w: 1.0 };
