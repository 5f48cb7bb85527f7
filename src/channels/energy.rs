//! `/energy`: the energy ledger, at frames, of which the last step is one; none without frames.

use super::{Channel, FieldNote, HEAD, Rate};
use crate::{case::Case, message::percuss, model::TargetEnergy, units::Units};

pub fn channel(case: &Case) -> Channel {
    let Units { time, energy: unit, .. } = case.units();
    let is_layered = case.sizes.layers.len() > 1;
    let layers = [
        ("layer_strain", "strain energy of every layer from the struck surface down"),
        (
            "layer_kinetic",
            "kinetic energy of every layer; that of an interface is shared by the masses of its halves",
        ),
    ];
    let fields = [
        ("kinetic", "kinetic energy of the target, mean of those between the level and its neighbours"),
        (
            "strain",
            "strain energy of the target, from displacements of two levels: below 0 where it is small, and behind a front that a free back \
             has sent back, by as much as kinetic is too large",
        ),
        ("indenter", "kinetic energy of an indenter of finite mass"),
        ("dissipated", "energy lost so far to nodes that struck the indenter and stuck"),
        ("damped", "energy taken out so far by the damping of waves that the mesh does not resolve"),
        ("work", "work done so far by a motion that is prescribed"),
        (
            "residual",
            "initial + work - all of the above: rounding; absent where waves are damped, as damped is then what is missing",
        ),
    ];
    let striker = [
        (
            "striker_kinetic",
            "kinetic energy of the indenter, which gives; of a half-space that of its motion beside V0",
        ),
        ("striker_strain", "strain energy of the indenter"),
    ];
    let gives = case.indenter.striker.is_some();
    let fields = fields.into_iter().chain(layers.into_iter().filter(|_| is_layered));
    let fields = fields.chain(striker.into_iter().filter(|_| gives));
    let note = |(name, meaning): (&'static str, &str)| {
        FieldNote::new(name, unit.name, format!("{meaning}{}", unit.part()))
    };
    Channel::new("/energy", "percuss.Energy", fields.map(note).collect(), move |view, outlet| {
        let Some(frame) = &view.frame else { return };
        let energy = frame.energy;
        let of_layers = |part: fn(&TargetEnergy) -> f64| {
            let layers = frame.fields.layers.iter().filter(|_| is_layered);
            layers.map(|[before, after]| unit.of(0.5 * (part(before) + part(after)))).collect()
        };
        outlet.put(&percuss::Energy {
            step: view.step,
            time: time.of(view.time),
            kinetic: unit.of(energy.kinetic),
            strain: unit.of(energy.strain),
            indenter: unit.of(energy.indenter),
            dissipated: unit.of(energy.dissipated),
            work: unit.of(energy.work),
            residual: energy.residual.map(|residual| unit.of(residual)),
            damped: unit.of(energy.damped),
            layer_strain: of_layers(|energy| energy.strain),
            layer_kinetic: of_layers(|energy| energy.kinetic),
            striker_kinetic: energy.striker.map(|striker| unit.of(striker.kinetic)),
            striker_strain: energy.striker.map(|striker| unit.of(striker.strain)),
        });
    })
    .emits(Rate::Frame(2 * HEAD))
}
