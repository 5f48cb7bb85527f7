//! What a random sample of inputs does to what is measured: mean and band of every measure, and the input that explains it.
//!
//! The band is from the 5th to the 95th percentile. An input explains a measure by the correlation of their ranks (Spearman's ρ): ±1 where the
//! measure rises or falls with it whatever the others are, 0 where it does not depend on it.

use std::io;

use percuss_table::{Cell, CellType, Heading, Sink};

/// Columns of a summary, as they come.
#[derive(Default)]
pub struct Columns {
    headings: Vec<Heading>,
    columns: Vec<Vec<Cell>>,
}

impl Sink for Columns {
    fn begin(&mut self, headings: &[Heading]) -> io::Result<()> {
        self.headings = headings.to_vec();
        self.columns = vec![Vec::new(); headings.len()];
        Ok(())
    }

    fn row(&mut self, cells: &[Cell]) -> io::Result<()> {
        self.columns.iter_mut().zip(cells).for_each(|(column, cell)| column.push(cell.clone()));
        Ok(())
    }

    fn end(&mut self) -> io::Result<()> {
        Ok(())
    }
}

const BAND: [f64; 2] = [0.05, 0.95];
/// Fewest cases of which there is a band.
const FEWEST: usize = 3;

/// What a sample makes of a measure.
#[derive(Clone, Debug, PartialEq)]
pub struct Spread {
    pub heading: Heading,
    /// Mean, and the ends of the band.
    pub values: [f64; 3],
    /// The input that explains it best, with the correlation of ranks, if any is a number.
    pub explained: Option<(String, f64)>,
}

impl Columns {
    /// Of every measure that is known of some cases and not the same in all.
    ///
    /// * `varied`: number of the columns that vary, behind the number of the case
    pub fn spreads(&self, varied: usize) -> Vec<Spread> {
        // the number of the case first, behind what varies the status
        let measures = self.headings.iter().zip(&self.columns).skip(varied + 2);
        let numbers = measures.filter(|(heading, _)| heading.kind == CellType::Double);
        numbers.filter_map(|(heading, column)| self.spread(heading, column, varied)).collect()
    }

    fn spread(&self, heading: &Heading, column: &[Cell], varied: usize) -> Option<Spread> {
        let known = |(row, cell): (usize, &Cell)| Some((row, cell.number().filter(|x| x.is_finite())?));
        let (rows, values): (Vec<usize>, Vec<f64>) = column.iter().enumerate().filter_map(known).unzip();
        if values.len() < FEWEST || values.iter().all(|value| *value == values[0]) {
            return None;
        }
        let mut sorted = values.clone();
        sorted.sort_by(f64::total_cmp);
        let mean = values.iter().sum::<f64>() / values.len() as f64;
        let [low, high] = BAND.map(|share| quantile(&sorted, share));
        let explains = |input: usize| {
            let of = rows.iter().map(|row| self.columns[input][*row].number());
            let correlation = correlation(&ranks(&of.collect::<Option<Vec<_>>>()?), &ranks(&values));
            Some((self.headings[input].name.clone(), correlation))
        };
        let explained = (1..=varied).filter_map(explains).max_by(|a, b| a.1.abs().total_cmp(&b.1.abs()));
        Some(Spread { heading: heading.clone(), values: [mean, low, high], explained })
    }
}

pub fn write(spreads: &[Spread], sink: &mut dyn Sink) -> io::Result<()> {
    let heading = |name: &str, kind| Heading { name: name.into(), unit: None, kind };
    let numbers = ["mean", "low_5", "high_95"].map(|name| heading(name, CellType::Double));
    let start = ["measure", "unit"].map(|name| heading(name, CellType::Text));
    let end = [heading("explained_by", CellType::Text), heading("rank_correlation", CellType::Double)];
    sink.begin(&[&start[..], &numbers, &end].concat())?;
    for Spread { heading, values, explained } in spreads {
        let text = |text: Option<String>| text.map_or(Cell::Empty, Cell::Text);
        let (by, rho) =
            explained.clone().map_or((None, Cell::Empty), |(by, rho)| (Some(by), Cell::Double(rho)));
        let row = [text(Some(heading.name.clone())), text(heading.unit.clone())];
        sink.row(&[&row[..], &values.map(Cell::Double), &[text(by), rho]].concat())?;
    }
    sink.end()
}

/// The value below which a share of sorted ones lies, linear between them.
fn quantile(sorted: &[f64], share: f64) -> f64 {
    let place = share * (sorted.len() - 1) as f64;
    let below = place.floor() as usize;
    let above = (below + 1).min(sorted.len() - 1);
    sorted[below] + (place - below as f64) * (sorted[above] - sorted[below])
}

/// Ranks of values, equal ones with the mean of theirs.
fn ranks(values: &[f64]) -> Vec<f64> {
    let mut order: Vec<usize> = (0..values.len()).collect();
    order.sort_by(|a, b| values[*a].total_cmp(&values[*b]));
    let mut ranks = vec![0.0; values.len()];
    let mut first = 0;
    for equal in order.chunk_by(|a, b| values[*a] == values[*b]) {
        let mean = first as f64 + 0.5 * (equal.len() - 1) as f64;
        equal.iter().for_each(|place| ranks[*place] = mean);
        first += equal.len();
    }
    ranks
}

/// Pearson's correlation; 0 if either does not vary.
fn correlation(x: &[f64], y: &[f64]) -> f64 {
    let mean = |values: &[f64]| values.iter().sum::<f64>() / values.len() as f64;
    let (mx, my) = (mean(x), mean(y));
    let sum = |f: fn(f64, f64) -> f64| x.iter().zip(y).map(|(x, y)| f(x - mx, y - my)).sum::<f64>();
    let norm = (sum(|x, _| x * x) * sum(|_, y| y * y)).sqrt();
    if norm > 0.0 { sum(|x, y| x * y) / norm } else { 0.0 }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_input_that_explains_a_measure_is_found() {
        let heading = |name: &str, kind| Heading { name: name.into(), unit: None, kind };
        let headings = [
            heading("case", CellType::UInt),
            heading("a", CellType::Double),
            heading("b", CellType::Double),
            heading("status", CellType::Text),
            heading("force", CellType::Double),
            heading("same", CellType::Double),
            heading("rare", CellType::Double),
        ];
        let mut columns = Columns::default();
        columns.begin(&headings).expect("room");
        for case in 0..101 {
            let (a, b) = (f64::from(case), f64::from(case * 37 % 101));
            // falls with b, whatever a is
            let force = (-0.03 * b).exp() + 1e-6 * a;
            let rare = if case == 7 { Cell::Double(1.0) } else { Cell::Empty };
            let cells = [a, b].map(Cell::Double);
            let rest = [Cell::Text("completed".into()), Cell::Double(force), Cell::Double(2.0), rare];
            columns.row(&[&[Cell::UInt(case as u64)][..], &cells, &rest].concat()).expect("room");
        }
        let [found] = &columns.spreads(2)[..] else { panic!("{:?}", columns.spreads(2)) };
        let (by, rho) = found.explained.clone().expect("an input");
        assert_eq!((&found.heading.name[..], &by[..]), ("force", "b"));
        assert!(rho < -0.999);
        // 5 and 95 of the 101 forces are below and above
        let [_, low, high] = found.values;
        for (found, b) in [(low, 95.0), (high, 5.0)] {
            assert!((found - f64::exp(-0.03 * b)).abs() < 1e-3);
        }
        assert_eq!(ranks(&[2.0, 1.0, 2.0, 5.0]), [1.5, 0.0, 1.5, 3.0]);
    }
}
