//! What happens at a contact: restitution and friction.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// `[contact]`
#[derive(Clone, Debug, Default, Deserialize, Serialize, JsonSchema, PartialEq)]
#[serde(deny_unknown_fields)]
pub struct Contacts {
    /// Between two grains; needed unless `interference = "none"`.
    pub grain: Option<Contact>,
    /// Between a grain and the surface; needed where there is a surface.
    pub surface: Option<Contact>,
    /// What happens to grains that collide again and again in no time.
    #[serde(default)]
    pub collapse: Collapse,
    /// How long a contact takes, s, where forces act: a force on two grains that touch acts for so long during their contact, and adds to its
    /// impulse (Arbelaez et al. 2009, eq. 10, 20, 26 and 32). Left out, contact is instantaneous.
    pub time: Option<f64>,
}

/// What happens to grains that collide again and again in no time, as hard grains of low restitution do.
#[derive(Clone, Copy, Debug, Default, Deserialize, Serialize, JsonSchema, PartialEq, Eq)]
#[serde(rename_all = "kebab-case")]
pub enum Collapse {
    /// A grain that hits at least three partners 16 times in a row, each within 0.001 radii of flight of the hit before, collides elastically
    /// until it flies freely again (after the TC model of Luding & McNamara 1998); so does one between two partners whose approach
    /// speed has not halved in 64 such hits. The energy that is not dissipated so is reported.
    #[default]
    Elastic,
    /// Nothing: every hit follows its law. A collapse may then take millions of hits, and may not end.
    None,
}

/// `[contact.grain]` or `[contact.surface]`
#[derive(Clone, Debug, Deserialize, Serialize, JsonSchema, PartialEq)]
#[serde(deny_unknown_fields)]
pub struct Contact {
    /// Normal restitution e, from 0 (nothing comes back) to 1 (elastic).
    pub restitution: f64,
    /// Coulomb friction; left out, the contact is smooth and grains do not spin.
    #[serde(default)]
    pub friction: Friction,
}

/// Friction at a contact.
#[derive(Clone, Debug, Deserialize, Serialize, JsonSchema, PartialEq)]
#[serde(untagged)]
pub enum Friction {
    /// One coefficient, static and dynamic.
    Coefficient(f64),
    /// Two coefficients (Arbelaez et al. 2009, eq. 20 and 32).
    StaticDynamic(StaticDynamic),
    /// The regularised law of Mukherjee & Zohdi (2015), eq. 11 and 12.
    Regularised(Regularised),
}

impl Default for Friction {
    fn default() -> Self {
        Self::Coefficient(0.0)
    }
}

/// Static and dynamic friction.
#[derive(Clone, Copy, Debug, Deserialize, Serialize, JsonSchema, PartialEq)]
#[serde(deny_unknown_fields)]
pub struct StaticDynamic {
    /// mu_s: up to this traction the contact sticks.
    #[serde(rename = "static")]
    pub static_: f64,
    /// mu_d: the traction of a slipping contact; at most mu_s.
    pub dynamic: f64,
}

/// Regularised friction.
#[derive(Clone, Copy, Debug, Deserialize, Serialize, JsonSchema, PartialEq)]
#[serde(deny_unknown_fields)]
pub struct Regularised {
    /// mu, approached at large slip.
    pub coefficient: f64,
    /// epsilon: slip speed below which the traction falls linearly to zero, m/s.
    pub slip_speed: f64,
}
