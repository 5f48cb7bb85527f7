//! Tables in prefixed units: SI columns scaled so that their largest number has one to three digits before the point.

use std::{collections::HashMap, io};

use crate::{
    prefix::Prefixed,
    table::{Cell, CellType, Heading, Sink},
};

/// The largest magnitude of every column of a table; takes no memory for its rows.
#[derive(Debug, Default)]
pub struct Largest {
    columns: Vec<f64>,
}

impl Sink for Largest {
    fn begin(&mut self, headings: &[Heading]) -> io::Result<()> {
        self.columns = vec![0.0; headings.len()];
        Ok(())
    }

    fn row(&mut self, cells: &[Cell]) -> io::Result<()> {
        for (largest, cell) in self.columns.iter_mut().zip(cells) {
            let number = cell.number().map(f64::abs).filter(|number| number.is_finite());
            *largest = largest.max(number.unwrap_or(0.0));
        }
        Ok(())
    }
}

impl Largest {
    /// The unit of every column; `None` where it stays as it is.
    ///
    /// * `groups`: columns of the same group and unit share a prefix
    pub fn units(&self, headings: &[Heading], groups: &[String]) -> Vec<Option<Prefixed>> {
        let mut largest: HashMap<_, f64> = HashMap::new();
        for ((heading, group), number) in headings.iter().zip(groups).zip(&self.columns) {
            let largest = largest.entry((group, &heading.unit)).or_default();
            *largest = largest.max(*number);
        }
        let unit = |(heading, group): (&Heading, &String)| {
            let unit = heading.unit.as_deref().filter(|_| takes_prefix(heading))?;
            let largest = largest.get(&(group, &heading.unit)).copied().unwrap_or_default();
            Prefixed::choose(unit, largest).filter(|chosen| chosen.factor != 1.0)
        };
        headings.iter().zip(groups).map(unit).collect()
    }
}

/// True for columns whose unit can have a prefix.
pub fn takes_prefix(heading: &Heading) -> bool {
    let is_scalable = matches!(heading.kind, CellType::Double | CellType::Float);
    is_scalable && heading.unit.as_deref().is_some_and(|unit| Prefixed::choose(unit, 1.0).is_some())
}

/// Hands a table on in other units.
pub struct InUnits<'a> {
    sink: &'a mut dyn Sink,
    units: Vec<Option<Prefixed>>,
    cells: Vec<Cell>,
}

impl<'a> InUnits<'a> {
    /// * `units`: unit of every column; `None` for those that stay
    pub fn new(sink: &'a mut dyn Sink, units: Vec<Option<Prefixed>>) -> Self {
        Self { sink, units, cells: Vec::new() }
    }
}

impl Sink for InUnits<'_> {
    fn begin(&mut self, headings: &[Heading]) -> io::Result<()> {
        let mut headings = headings.to_vec();
        for (heading, unit) in headings.iter_mut().zip(&self.units) {
            if let Some(chosen) = unit {
                heading.unit = Some(chosen.unit.clone());
            }
        }
        self.sink.begin(&headings)
    }

    fn row(&mut self, cells: &[Cell]) -> io::Result<()> {
        self.cells.clear();
        let scaled = |(cell, unit): (&Cell, &Option<Prefixed>)| match (cell, unit) {
            (Cell::Double(number), Some(unit)) => Cell::Double(unit.apply(*number)),
            (Cell::Float(number), Some(unit)) => Cell::Float(unit.apply(f64::from(*number)) as f32),
            (cell, _) => cell.clone(),
        };
        self.cells.extend(cells.iter().zip(&self.units).map(scaled));
        self.sink.row(&self.cells)
    }

    fn group(&mut self) -> io::Result<()> {
        self.sink.group()
    }

    fn end(&mut self) -> io::Result<()> {
        self.sink.end()
    }
}
