use schemars::JsonSchema;
use serde::Deserialize;
use supple::parameters::Parameters;
use supple::{Channel, Channels, Dimensions, Model, PlainFile, Point, Scalar, Unfit, Value};

/// Standard gravity, m/s^2.
pub const GRAVITY: f64 = 9.81;

/// A pole on a cart, upright at angle 0; the place of the cart and that of the pole's tip beside it are measured.
///
/// State `[x, a, x', a']`, control `F`:
///
/// ```text
/// (M + m) x'' + m l (a'' cos a - a'^2 sin a) = F      l a'' + x'' cos a = g sin a
/// ```
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct CartPole {
    /// Mass of the cart, kg.
    pub cart_mass: Value,
    /// Mass of the pole, at its tip, kg.
    pub pole_mass: Value,
    /// Length of the pole, m.
    pub length: Value,
}

impl Model for CartPole {
    fn dimensions(&self) -> Dimensions {
        Dimensions { states: 4, controls: 1, measurements: 2 }
    }

    fn step<S: Scalar>(&self, at: &Point<S>, next: &mut [S]) {
        let &[place, angle, speed, rate] = at.x else { return };
        let (sin, cos) = angle.sin_cos();
        let (pole, length) = (at.value(&self.pole_mass), at.value(&self.length));
        let force = at.u[0] + pole * sin * (length * rate.square() - cos * GRAVITY);
        let push = force / (at.value(&self.cart_mass) + pole * sin.square());
        let turn = (sin * GRAVITY - push * cos) / length;
        next[0] = place + at.time_step * speed;
        next[1] = angle + at.time_step * rate;
        next[2] = speed + at.time_step * push;
        next[3] = rate + at.time_step * turn;
    }

    fn observe<S: Scalar>(&self, at: &Point<S>, y: &mut [S]) {
        y[0] = at.x[0];
        y[1] = at.value(&self.length) * at.x[1].sin();
    }

    fn state_names(&self) -> Vec<String> {
        ["place", "angle", "speed", "rate"].map(String::from).to_vec()
    }

    fn channels(&self) -> Channels {
        let units = ["m", "rad", "m/s", "rad/s"];
        Channels {
            states: self.state_names().into_iter().zip(units).map(|(name, unit)| Channel::new(name, unit)).collect(),
            controls: vec![Channel::new("force", "N")],
            measurements: vec![Channel::new("cart", "m"), Channel::new("tip", "m")],
        }
    }
}

impl PlainFile for CartPole {
    const NAME: &'static str = "cart_pole";

    fn check(&self, parameters: &Parameters) -> Result<(), Unfit> {
        let values = [("cart_mass", &self.cart_mass), ("pole_mass", &self.pole_mass), ("length", &self.length)];
        for (key, value) in values {
            if let Some(least) = parameters.least(value).filter(|&least| least <= 0.0) {
                return Err(Unfit::new(key, format!("must be above 0; found {least}")));
            }
        }
        Ok(())
    }
}
