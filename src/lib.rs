//! percuss: a rigid indenter strikes an elastic layer or half-space, computed by a scheme of minimised mesh
//! dispersion and recorded as MCAP.

pub mod case;
pub mod channels;
pub mod contact;
pub mod exact;
pub mod grid;
pub mod indenter;
pub mod material;
pub mod message;
pub mod model;
pub mod recording;
pub mod session;
pub mod shape;
pub mod simulation;
pub mod surface;
pub mod units;
pub mod validity;
pub mod view;
