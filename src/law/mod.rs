//! What happens at a contact: states in, impulse out; no file, no chance, no engine.

mod impulse;
pub(crate) mod near_field;

pub(crate) use impulse::friction;
pub use impulse::{
    Body, External, Impulse, PairImpulse, SurfaceImpulse, resolve_pair, resolve_pair_under, resolve_surface,
    resolve_surface_under,
};
pub use near_field::{InvalidTerm, NearField, Term};

use crate::scene;

/// The law of one sort of contact.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ContactLaw {
    /// Normal restitution e, 0 to 1.
    pub restitution: f64,
    /// Friction.
    pub friction: Friction,
}

/// Friction at a contact.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Friction {
    /// None: only normal impulses, spins stay as they are.
    Smooth,
    /// Stick–slip Coulomb friction (Arbelaez et al. 2009, eq. 20 and 32).
    Coulomb {
        /// mu_s: the contact sticks while J_t ≤ mu_s J_n.
        static_: f64,
        /// mu_d: J_t = mu_d J_n where it slips.
        dynamic: f64,
    },
    /// Regularised Coulomb friction (Mukherjee & Zohdi 2015, eq. 11 and 12).
    Regularised {
        /// mu.
        coefficient: f64,
        /// epsilon, m/s: slip speed at which friction is fully developed.
        slip_speed: f64,
    },
}

impl From<&scene::Contact> for ContactLaw {
    fn from(contact: &scene::Contact) -> Self {
        let friction = match contact.friction {
            scene::Friction::Coefficient(0.0) => Friction::Smooth,
            scene::Friction::Coefficient(mu) => Friction::Coulomb { static_: mu, dynamic: mu },
            scene::Friction::StaticDynamic(scene::StaticDynamic { static_, dynamic }) => {
                Friction::Coulomb { static_, dynamic }
            }
            scene::Friction::Regularised(scene::Regularised { coefficient, slip_speed }) => {
                Friction::Regularised { coefficient, slip_speed }
            }
        };
        Self { restitution: contact.restitution, friction }
    }
}
