//! Which schemes are compared, and over which range of accuracy: the one place that knows their keys.

use crate::scene::{Scene, Scheme, Substep};

/// Sub-steps of the event-driven scheme over that of the scene, where forces act.
const SUB_STEPS: [f64; 4] = [4.0, 2.0, 1.0, 0.5];
/// Steps of the time-stepped schemes over the time in which the fastest grain flies a radius.
const STEPS: [f64; 6] = [0.4, 0.2, 0.1, 0.05, 0.025, 0.0125];
/// So many times finer than the finest sub-step of the ladder is that of the reference.
pub(super) const REFERENCE_FINER: f64 = 8.0;

/// What the range of a setting depends on.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Scales {
    /// Sub-step of the scene, s: given, or as its tolerance chooses it on average; none where no force acts.
    pub(super) sub_step: Option<f64>,
    /// Time in which the fastest grain flies a radius, s.
    pub(super) flight: f64,
}

/// A scheme and the one setting by which its accuracy is chosen.
#[derive(Debug)]
pub(super) struct Ladder {
    scheme: Scheme,
    /// Key of the setting; empty where the scheme is exact and has none.
    pub(super) setting: &'static str,
    /// Unit of the setting; empty for a plain number.
    pub(super) unit: &'static str,
    /// Values from coarse to fine, so that each takes longer than the one before; none where this ladder says nothing of the scene.
    values: fn(&Scales) -> Vec<f64>,
    /// Puts a value into a scene of this scheme.
    set: fn(&mut Scene, f64),
}

/// All of them. A scheme with several settings stands here several times; the others are then those of the scene, or their defaults. Where no force
/// acts, the fixed-point scheme iterates nothing, and predicted collisions choose its steps: only the overlap that it leaves counts.
static LADDERS: [Ladder; 8] = [
    Ladder {
        scheme: Scheme::EventDriven,
        setting: "",
        unit: "",
        values: |scales| if scales.sub_step.is_none() { vec![0.0] } else { Vec::new() },
        set: |_, _| {},
    },
    Ladder {
        scheme: Scheme::EventDriven,
        setting: "substep",
        unit: "s",
        values: |scales| {
            scales.sub_step.map_or_else(Vec::new, |step| SUB_STEPS.map(|times| rounded(times * step)).to_vec())
        },
        set: set_sub_step,
    },
    Ladder {
        scheme: Scheme::FixedPoint,
        setting: "tolerance",
        unit: "",
        values: |scales| if scales.sub_step.is_some() { vec![1e-3, 1e-4, 1e-5, 1e-6, 1e-7] } else { Vec::new() },
        set: |scene, value| scene.fixed_point.get_or_insert_default().tolerance = value,
    },
    Ladder {
        scheme: Scheme::FixedPoint,
        setting: "overlap",
        unit: "",
        values: |_| vec![1e-1, 1e-2, 1e-3, 1e-4, 1e-5, 1e-6],
        set: |scene, value| scene.fixed_point.get_or_insert_default().overlap = value,
    },
    Ladder {
        scheme: Scheme::FixedPoint,
        setting: "largest_step",
        unit: "s",
        values: |scales| if scales.sub_step.is_some() { steps(scales) } else { Vec::new() },
        set: |scene, value| scene.fixed_point.get_or_insert_default().largest_step = Some(value),
    },
    Ladder {
        scheme: Scheme::Trapezoidal,
        setting: "step",
        unit: "s",
        values: steps,
        set: |scene, value| scene.trapezoidal.get_or_insert_default().step = Some(value),
    },
    Ladder {
        scheme: Scheme::SoftSphere,
        setting: "young_modulus",
        unit: "Pa",
        values: |_| vec![1e8, 1e9, 1e10, 1e11, 1e12],
        set: |scene, value| scene.soft_sphere.get_or_insert_default().young_modulus = value,
    },
    Ladder {
        scheme: Scheme::SoftSphere,
        setting: "step_fraction",
        unit: "",
        values: |_| vec![0.16, 0.08, 0.04, 0.02, 0.01],
        set: |scene, value| scene.soft_sphere.get_or_insert_default().step_fraction = value,
    },
];

fn steps(scales: &Scales) -> Vec<f64> {
    STEPS.map(|times| rounded(times * scales.flight)).to_vec()
}

/// To three digits: nobody wants to read more of a setting.
fn rounded(value: f64) -> f64 {
    format!("{value:.2e}").parse().unwrap_or(value)
}

/// One run to be made.
#[derive(Clone, Debug)]
pub(super) struct Rung {
    /// Value of the setting; none where there is none.
    pub(super) value: Option<f64>,
    /// The scene with the scheme and the setting put in.
    pub(super) scene: Scene,
}

/// The schemes that can be compared, as the scene file calls them.
pub fn scheme_names() -> impl Iterator<Item = &'static str> {
    let first = |place: &usize| LADDERS[..*place].iter().all(|earlier| earlier.scheme != LADDERS[*place].scheme);
    (0..LADDERS.len()).filter(first).map(|place| LADDERS[place].scheme.name())
}

/// The ladders of the named schemes, or of all where none is named.
pub(super) fn ladders(names: &[String]) -> impl Iterator<Item = &'static Ladder> {
    LADDERS.iter().filter(move |ladder| names.is_empty() || names.iter().any(|name| name == ladder.name()))
}

impl Ladder {
    /// The scheme as the scene file calls it.
    pub(super) fn name(&self) -> &'static str {
        self.scheme.name()
    }

    /// What a run of it is called.
    pub(super) fn label(&self, value: Option<f64>) -> String {
        match value {
            Some(value) => format!("{}, {} {value:e} {}", self.name(), self.setting, self.unit).trim_end().to_owned(),
            None => self.name().to_owned(),
        }
    }

    /// The runs to be made of a scene, from coarse to fine; `quick` makes every second.
    pub(super) fn rungs(&self, scene: &Scene, scales: &Scales, quick: bool) -> Vec<Rung> {
        let every = if quick { 2 } else { 1 };
        let rung = |value| {
            let mut scene = with_scheme(scene, self.scheme);
            (self.set)(&mut scene, value);
            Rung { value: (!self.setting.is_empty()).then_some(value), scene }
        };
        (self.values)(scales).into_iter().step_by(every).map(rung).collect()
    }
}

/// The scene with the event-driven scheme, and a sub-step (s) where forces act.
pub(super) fn event_driven(scene: &Scene, sub_step: Option<f64>) -> Scene {
    let mut scene = with_scheme(scene, Scheme::EventDriven);
    if let Some(step) = sub_step {
        set_sub_step(&mut scene, step);
    }
    scene
}

/// The scene with another scheme, and without the keys that belong to the others.
fn with_scheme(scene: &Scene, scheme: Scheme) -> Scene {
    let mut scene = scene.clone();
    scene.run.scheme = scheme;
    scene.fixed_point = scene.fixed_point.filter(|_| scheme == Scheme::FixedPoint);
    scene.trapezoidal = scene.trapezoidal.filter(|_| scheme == Scheme::Trapezoidal);
    scene.soft_sphere = scene.soft_sphere.filter(|_| scheme == Scheme::SoftSphere);
    if scheme != Scheme::EventDriven {
        scene.run.substep = None;
        if let Some(near_field) = &mut scene.near_field {
            (near_field.substep, near_field.tolerance) = (None, None);
        }
    }
    scene
}

/// The finest sub-step of the ladder for a scene of this sub-step, s.
pub(super) fn finest_sub_step(scene_step: f64) -> f64 {
    rounded(SUB_STEPS[SUB_STEPS.len() - 1] * scene_step)
}

fn set_sub_step(scene: &mut Scene, step: f64) {
    match &mut scene.near_field {
        Some(near_field) => {
            // A tolerance means nothing beside a fixed sub-step.
            (near_field.substep, near_field.tolerance) = (Some(Substep::Fixed(step)), None);
            scene.run.substep = None;
        }
        None => scene.run.substep = Some(step),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::{Overrides, SceneFile, SoftSphere, check};

    const SCALES: Scales = Scales { sub_step: Some(4e-6), flight: 1e-4 };

    fn scene(set: &[&str]) -> Scene {
        let overrides = Overrides { set: set.iter().map(|text| (*text).to_owned()).collect(), ..Overrides::default() };
        let text = include_str!("../../../examples/near_field_jet.toml");
        SceneFile::parse("jet.toml".as_ref(), text, &overrides).expect("the example is valid").scene
    }

    #[test]
    fn without_forces_the_event_driven_scheme_is_one_exact_run() {
        let mut free = scene(&[]);
        (free.near_field, free.run.penetration) = (None, None);
        let (scales, names) = (Scales { sub_step: None, ..SCALES }, ["event-driven".to_owned()]);
        let rungs = ladders(&names).flat_map(|ladder| ladder.rungs(&free, &scales, false));
        let rungs: Vec<_> = rungs.map(|rung| (rung.value, rung.scene)).collect();
        assert_eq!(rungs, [(None, free.clone())]);
    }

    #[test]
    fn with_forces_its_sub_steps_are_halved() {
        let names = ["event-driven".to_owned()];
        let mut falling = scene(&["run.gravity=[0, 0, -9.81]"]);
        falling.near_field = None;
        let chosen = scene(&["near_field.substep=auto", "near_field.tolerance=1e-5"]);
        for scene in [falling, scene(&[]), chosen] {
            let rungs = ladders(&names).flat_map(|ladder| ladder.rungs(&scene, &SCALES, false));
            let steps: Vec<_> = rungs.map(|rung| (rung.value, rung.scene.substep())).collect();
            assert_eq!(steps, [16e-6, 8e-6, 4e-6, 2e-6].map(|step| (Some(step), Substep::Fixed(step))));
        }
    }

    #[test]
    fn every_setting_of_every_scheme_is_one_that_a_scene_may_have() {
        let mut soft = scene(&[]);
        (soft.near_field, soft.run.penetration) = (None, None);
        soft.run.scheme = Scheme::SoftSphere;
        soft.soft_sphere = Some(SoftSphere { poisson_ratio: 0.2, ..SoftSphere::default() });
        for (scene, sub_step) in [(scene(&[]), Some(4e-6)), (soft, None)] {
            let scales = Scales { sub_step, ..SCALES };
            for ladder in ladders(&[]) {
                for rung in ladder.rungs(&scene, &scales, false) {
                    assert_eq!(check(&rung.scene), Ok(()), "{}", ladder.label(rung.value));
                    let kept = rung.scene.soft_sphere.is_none_or(|table| {
                        table.poisson_ratio == scene.soft_sphere.map_or(0.3, |own| own.poisson_ratio)
                    });
                    assert!(kept, "what the scene says beside the setting stays");
                }
            }
        }
    }

    #[test]
    fn each_scheme_is_named_once() {
        assert_eq!(scheme_names().collect::<Vec<_>>(), ["event-driven", "fixed-point", "trapezoidal", "soft-sphere"]);
    }
}
