//! From the text of a model or payload file to checked numbers.
//!
//! Every number has a range in which the rest of the program works as specified: values in frames fit the frame, mass
//! matrices are positive definite, positions fit the 32 bits of an encoder. The ranges are wide; a number outside them
//! is in another unit or a typing error, and the message says which.

mod drive;

use std::f64::consts::PI;

use super::file::{
    self, ACCELERATION, ANGLE, COORDINATE, EFFORT, GRAVITY, JERK, LENGTH, LINK_INERTIA, LINK_MASS,
    PAYLOAD_MAX, POSITION, RISE_TIME, VELOCITY, keys,
};
use super::json::{self, Node};
use super::{Geometry, JointLimits, Link, ModelError, Payload, RobotModel};
use crate::allowed::schema::Each;
use crate::allowed::{
    Allowed, PAYLOAD_COM, PAYLOAD_INERTIA, PAYLOAD_MASS, check_mass, check_moments,
};
use crate::maths::hypot;
use crate::text::{IN_A_NAME, Source};

/// Tolerance for a derived or implied number to agree with another one: model files carry rounded decimals.
const SAME: f64 = 1e-9;

pub(super) fn robot(text: &str) -> Result<(RobotModel, Vec<String>), ModelError> {
    let value = json::parse(text)?;
    let root = Node::root(text, &value);
    let mut warnings = Vec::new();
    let geometry = geometry(
        &root.get("dh", "the Denavit-Hartenberg table")?,
        &mut warnings,
    )?;
    units(&root)?;
    let links = links(&root, &geometry, &mut warnings)?;
    let limits = limits(
        &root.get("joint_limits", "the limits of the joints")?,
        &mut warnings,
    )?;
    let drive = drive::drive(
        &root.get("drive", "the data of motors, gears and friction")?,
        &limits,
        &mut warnings,
    )?;
    let model = RobotModel {
        name: name(&root)?,
        gravity: gravity(&root)?,
        geometry,
        limits,
        links,
        drive,
        payload_max: payload_max(&root.get("payload_rated_max_kg", "an object")?)?,
        source: Source {
            origin: String::new(),
            text: text.into(),
        },
    };
    root.warn_of_unknown(&keys::<file::ModelFile>(), &mut warnings);
    Ok((model, warnings))
}

pub(super) fn payload(text: &str) -> Result<Payload, ModelError> {
    let value = json::parse(text)?;
    let root = Node::root(text, &value);
    root.refuse_unknown(&keys::<file::PayloadFile>())?;
    let payload = Payload {
        mass: root.number("mass", PAYLOAD_MASS)?,
        com: root.numbers("com_flange_frame", PAYLOAD_COM)?,
        // A point mass, and a gripper's empty hand, are allowed at the flange.
        inertia: inertia(&root, PAYLOAD_INERTIA)?,
    };
    match check_mass(payload.mass, payload.inertia) {
        Ok(()) => Ok(payload),
        Err(allowed) => Err(root.get("inertia_com_diag", "")?.wrong(allowed)),
    }
}

fn name(root: &Node<'_>) -> Result<String, ModelError> {
    match root.string("name")? {
        name if name.contains(char::is_control) => Err(root.get("name", "")?.wrong(IN_A_NAME)),
        name => Ok(name.to_owned()),
    }
}

/// The heaviest payload, which the rated one does not exceed.
fn payload_max(node: &Node<'_>) -> Result<f64, ModelError> {
    let max = node.number("max", PAYLOAD_MAX)?;
    if let Some(rated) = node.optional("rated")
        && rated.as_number(PAYLOAD_MAX)? > max
    {
        return Err(rated.wrong(format!("at most the heaviest payload, {max} kg")));
    }
    Ok(max)
}

fn units(root: &Node<'_>) -> Result<(), ModelError> {
    match root.optional("units") {
        Some(units) if !units.as_str().is_some_and(|text| text.starts_with("SI")) => {
            Err(units.wrong("\"SI: m, kg, s, rad, N, N m\", in which every number is read"))
        }
        _ => Ok(()),
    }
}

fn gravity(root: &Node<'_>) -> Result<f64, ModelError> {
    let vector = root.get("gravity", "an array of 3: [0, 0, z]")?;
    let [x, y, _] = vector.as_numbers(Allowed::FINITE)?;
    if x != 0.0 || y != 0.0 {
        // The lift would no longer be the only axis that carries weight, which nothing here supports.
        return Err(vector.wrong("vertical: [0, 0, z]"));
    }
    let [_, _, z] = vector.elements::<3>(GRAVITY)?;
    if z.as_number(Allowed::FINITE)? > 0.0 {
        // Nor that a brake which lets go lets the lift rise.
        return Err(z.wrong(format!("{GRAVITY}: a robot that hangs is not supported")));
    }
    Ok(-z.as_number(GRAVITY)?)
}

fn geometry(dh: &Node<'_>, warnings: &mut Vec<String>) -> Result<Geometry, ModelError> {
    dh.warn_of_unknown(&keys::<file::Dh>(), warnings);
    let alpha: [f64; 4] = dh.numbers("alpha", ANGLE)?;
    let scara = [0.0, PI, 0.0, 0.0];
    if alpha
        .iter()
        .zip(scara)
        .any(|(found, wanted)| (found - wanted).abs() > SAME)
    {
        return Err(dh
            .get("alpha", "")?
            .wrong("[0, pi, 0, 0], the twists of a SCARA"));
    }
    Ok(Geometry {
        a1: dh.number("a1", LENGTH)?,
        a2: dh.number("a2", LENGTH)?,
        d1: dh.number("d1", COORDINATE)?,
        d2: dh.number("d2", COORDINATE)?,
        d4: dh.number("d4", COORDINATE)?,
    })
}

/// For files that say nothing of it, s: a servo drive's current loop with the motor's inductance.
const EFFORT_RISE_TIME: [f64; 4] = [0.010; 4];

/// Four numbers of the joints.
fn joints(node: &Node<'_>, key: &str, Each(allowed): Each<4>) -> Result<[f64; 4], ModelError> {
    let [turning, ..] = allowed;
    let elements = node
        .get(key, format!("an array of 4: {turning}"))?
        .elements::<4>(turning)?;
    let mut numbers = [0.0; 4];
    for ((number, element), allowed) in numbers.iter_mut().zip(&elements).zip(allowed) {
        *number = element.as_number(allowed)?;
    }
    Ok(numbers)
}

/// [`joints`], if there are any.
fn optional_joints(
    node: &Node<'_>,
    key: &str,
    allowed: Each<4>,
) -> Result<Option<[f64; 4]>, ModelError> {
    node.optional(key)
        .map(|_| joints(node, key, allowed))
        .transpose()
}

fn limits(node: &Node<'_>, warnings: &mut Vec<String>) -> Result<JointLimits, ModelError> {
    node.warn_of_unknown(&keys::<file::Limits>(), warnings);
    let limits = JointLimits {
        lower: joints(node, "lower", POSITION)?,
        upper: joints(node, "upper", POSITION)?,
        velocity: joints(node, "velocity", VELOCITY)?,
        acceleration: optional_joints(node, "acceleration_cap", ACCELERATION)?,
        jerk: optional_joints(node, "jerk_cap", JERK)?,
        effort: joints(node, "effort_peak", EFFORT)?,
        effort_rise_time: optional_joints(node, "effort_rise_time_s", RISE_TIME)?
            .unwrap_or(EFFORT_RISE_TIME),
        effort_continuous: joints(node, "effort_continuous_rms", EFFORT)?,
    };
    each(node, "upper", limits.upper, limits.lower, |upper, lower| {
        (upper <= lower).then(|| format!("above the lower limit {lower}"))
    })?;
    each(
        node,
        "effort_continuous_rms",
        limits.effort_continuous,
        limits.effort,
        |continuous, peak| (continuous > peak).then(|| format!("at most the peak, {peak}")),
    )?;
    Ok(limits)
}

/// Compares the elements of the array `key` with others; the error names the first that is `wrong`.
fn each(
    node: &Node<'_>,
    key: &str,
    values: [f64; 4],
    others: [f64; 4],
    wrong: impl Fn(f64, f64) -> Option<String>,
) -> Result<(), ModelError> {
    let elements = node.get(key, "")?.elements::<4>("")?;
    for (element, (value, other)) in elements.iter().zip(values.into_iter().zip(others)) {
        if let Some(expected) = wrong(value, other) {
            return Err(element.wrong(expected));
        }
    }
    Ok(())
}

fn links(
    root: &Node<'_>,
    geometry: &Geometry,
    warnings: &mut Vec<String>,
) -> Result<[Link; 4], ModelError> {
    let nodes = root
        .get("links", "an array of 4 links")?
        .elements::<4>("links")?;
    let mut links = [Link {
        mass: 0.0,
        com: [0.0; 3],
        inertia: [0.0; 3],
    }; 4];
    let known = keys::<file::Link>();
    for (index, (link, node)) in links.iter_mut().zip(&nodes).enumerate() {
        node.warn_of_unknown(&known, warnings);
        check_order(node, index)?;
        *link = Link {
            mass: node.number("mass", LINK_MASS)?,
            com: node.numbers("com_joint_frame", COORDINATE)?,
            inertia: inertia(node, LINK_INERTIA)?,
        };
        check_derived(
            node,
            link,
            com_in_dh_frame(geometry, index, link.com),
            warnings,
        )?;
    }
    Ok(links)
}

/// Links are identified by their order alone: a number in a name shows which one the author meant.
fn check_order(node: &Node<'_>, index: usize) -> Result<(), ModelError> {
    let Some(name) = node.optional("name") else {
        return Ok(());
    };
    let digits: String = name
        .as_str()
        .unwrap_or_default()
        .chars()
        .filter(char::is_ascii_digit)
        .collect();
    match digits.parse::<usize>() {
        Ok(number) if (1..=4).contains(&number) && number != index + 1 => Err(name.wrong(format!(
            "a link {} here: the order of links is arm 1, arm 2, carriage, shaft",
            index + 1
        ))),
        _ => Ok(()),
    }
}

/// Principal moments of inertia: of a body, none is greater than the sum of the other two.
fn inertia(node: &Node<'_>, allowed: Allowed) -> Result<[f64; 3], ModelError> {
    let moments: [f64; 3] = node.numbers("inertia_com_diag", allowed)?;
    let elements = node.get("inertia_com_diag", "")?.elements::<3>("")?;
    check_moments(moments).map_err(|(axis, expected)| elements[axis].wrong(expected))?;
    Ok(moments)
}

/// The centre of mass of link `index` in the standard DH frame, which is at the far end of the link.
fn com_in_dh_frame(geometry: &Geometry, index: usize, [x, y, z]: [f64; 3]) -> [f64; 3] {
    match index {
        0 => [x - geometry.a1, y, z - geometry.d1],
        1 => [x - geometry.a2, -y, geometry.d2 - z],
        2 => [x, y, z],
        _ => [x, y, z - geometry.d4],
    }
}

fn check_derived(
    node: &Node<'_>,
    link: &Link,
    com_dh: [f64; 3],
    warnings: &mut Vec<String>,
) -> Result<(), ModelError> {
    let mut warn =
        |derived: &Node<'_>, found: &dyn std::fmt::Debug, follows: &dyn std::fmt::Debug| {
            warnings.push(format!(
            "line {}: {} is {found:?}, but {}.com_joint_frame, which is used, gives {follows:?}",
            derived.line(),
            derived.path(),
            node.path()
        ));
        };
    if let Some(derived) = node.optional("com_dh_frame") {
        let found: [f64; 3] = derived.as_numbers(COORDINATE)?;
        if found.iter().zip(com_dh).any(|(a, b)| (a - b).abs() > SAME) {
            warn(&derived, &found, &com_dh);
        }
    }
    if let Some(derived) = node.optional("lc") {
        let found = derived.as_number(COORDINATE)?;
        let distance = hypot(link.com[0], link.com[1]);
        if (found.abs() - distance).abs() > SAME {
            warn(&derived, &found, &distance);
        }
    }
    Ok(())
}
