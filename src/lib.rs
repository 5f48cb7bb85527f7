//! percuss: a rigid indenter strikes an elastic layer or half-space, computed by a scheme of minimised mesh
//! dispersion and recorded as MCAP.

pub mod message;
