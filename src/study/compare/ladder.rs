//! Which schemes are compared, and over which range of accuracy: the one place that knows their keys.

use crate::scene::{Scene, Scheme, Substep};

/// Sub-steps of the event-driven scheme over that of the scene, where forces act.
const SUB_STEPS: [f64; 4] = [4.0, 2.0, 1.0, 0.5];
/// So many times finer than the finest sub-step of the ladder is that of the reference.
pub(super) const REFERENCE_FINER: f64 = 8.0;

/// What the range of a setting depends on.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Scales {
    /// Sub-step of the scene, s: given, or as its tolerance chooses it on average; none where no force acts.
    pub(super) sub_step: Option<f64>,
}

/// A scheme and the one setting by which its accuracy is chosen.
#[derive(Debug)]
pub(super) struct Ladder {
    scheme: Scheme,
    /// The scheme as the scene file calls it.
    pub(super) name: &'static str,
    /// Key of the setting; empty where the scheme is exact and has none.
    pub(super) setting: &'static str,
    /// Unit of the setting; empty for a plain number.
    pub(super) unit: &'static str,
    /// Values from coarse to fine, so that each takes longer than the one before; none where this ladder says nothing of the scene.
    values: fn(&Scales) -> Vec<f64>,
    /// Puts a value into a scene.
    set: fn(&mut Scene, f64),
}

/// All of them. A scheme with two settings may stand here twice.
static LADDERS: [Ladder; 2] = [
    Ladder {
        scheme: Scheme::EventDriven,
        name: "event-driven",
        setting: "",
        unit: "",
        values: |scales| if scales.sub_step.is_none() { vec![0.0] } else { Vec::new() },
        set: |_, _| {},
    },
    Ladder {
        scheme: Scheme::EventDriven,
        name: "event-driven",
        setting: "substep",
        unit: "s",
        values: |scales| scales.sub_step.map_or_else(Vec::new, |step| SUB_STEPS.map(|times| times * step).to_vec()),
        set: set_sub_step,
    },
];

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
    let repeated = |place: usize| LADDERS[..place].iter().any(|earlier| earlier.name == LADDERS[place].name);
    (0..LADDERS.len()).filter(move |&place| !repeated(place)).map(|place| LADDERS[place].name)
}

/// The ladders of the named schemes, or of all where none is named.
pub(super) fn ladders(names: &[String]) -> impl Iterator<Item = &'static Ladder> {
    LADDERS.iter().filter(move |ladder| names.is_empty() || names.iter().any(|name| name == ladder.name))
}

impl Ladder {
    /// What a run of it is called.
    pub(super) fn label(&self, value: Option<f64>) -> String {
        match value {
            Some(value) => format!("{}, {} {value:e} {}", self.name, self.setting, self.unit).trim_end().to_owned(),
            None => self.name.to_owned(),
        }
    }

    /// The runs to be made of a scene, from coarse to fine; `quick` makes every second.
    pub(super) fn rungs(&self, scene: &Scene, scales: &Scales, quick: bool) -> Vec<Rung> {
        let every = if quick { 2 } else { 1 };
        let rung = |value| {
            let mut scene =
                Scene { run: crate::scene::Run { scheme: self.scheme, ..scene.run.clone() }, ..scene.clone() };
            (self.set)(&mut scene, value);
            Rung { value: (!self.setting.is_empty()).then_some(value), scene }
        };
        (self.values)(scales).into_iter().step_by(every).map(rung).collect()
    }
}

/// The scene with the event-driven scheme, and a sub-step (s) where forces act.
pub(super) fn event_driven(scene: &Scene, sub_step: Option<f64>) -> Scene {
    let mut scene = scene.clone();
    scene.run.scheme = Scheme::EventDriven;
    if let Some(step) = sub_step {
        set_sub_step(&mut scene, step);
    }
    scene
}

/// The finest sub-step of the ladder, s.
pub(super) fn finest_sub_step(scales: &Scales) -> Option<f64> {
    scales.sub_step.map(|step| SUB_STEPS[SUB_STEPS.len() - 1] * step)
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
    use crate::scene::{Overrides, SceneFile, check};

    fn scene(set: &[&str]) -> Scene {
        let overrides = Overrides { set: set.iter().map(|text| (*text).to_owned()).collect(), ..Overrides::default() };
        let text = include_str!("../../../examples/near_field_jet.toml");
        SceneFile::parse("jet.toml".as_ref(), text, &overrides).expect("the example is valid").scene
    }

    #[test]
    fn without_forces_the_event_driven_scheme_is_one_exact_run() {
        let mut free = scene(&[]);
        free.near_field = None;
        let runs: Vec<_> = ladders(&["event-driven".into()])
            .flat_map(|ladder| ladder.rungs(&free, &Scales { sub_step: None }, false))
            .collect();
        assert_eq!(runs.len(), 1);
        assert_eq!((runs[0].value, &runs[0].scene), (None, &free));
    }

    #[test]
    fn with_forces_its_sub_steps_are_halved_and_every_scene_is_valid() {
        let gravity = "run.gravity=[0, 0, -9.81]";
        let mut falling = scene(&[gravity]);
        falling.near_field = None;
        let chosen = scene(&["near_field.substep=auto", "near_field.tolerance=1e-5"]);
        for scene in [falling, scene(&[gravity]), chosen] {
            let scales = Scales { sub_step: Some(4e-6) };
            let rungs: Vec<_> = ladders(&[]).flat_map(|ladder| ladder.rungs(&scene, &scales, false)).collect();
            let values: Vec<_> = rungs.iter().filter_map(|rung| rung.value).collect();
            assert_eq!(values, [16e-6, 8e-6, 4e-6, 2e-6]);
            for rung in rungs {
                assert_eq!(check(&rung.scene), Ok(()));
                assert_eq!(rung.scene.substep(), Substep::Fixed(rung.value.expect("it has one")));
            }
        }
    }

    #[test]
    fn each_scheme_is_named_once() {
        let names: Vec<_> = scheme_names().collect();
        let mut once = names.clone();
        once.dedup();
        assert_eq!(names, once);
        assert!(names.contains(&"event-driven"));
    }
}
