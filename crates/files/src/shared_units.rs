//! One unit for each quantity of a set, whatever its files write.

use super::error::{ReadError, ReadProblem};
use sindyscope_values::record::units;
use sindyscope_values::record::{Record, Role};

/// The unit of what is measured in `unit`, made of a displacement's unit, and how many of it one `unit` is: `mm/s` is
/// 0.001 of the `m/s` that belongs to `m`. None if it is another quantity than the displacement or its rates.
pub(super) fn derived(displacement: &str, unit: &str) -> Option<(String, f64)> {
    let (reference, known) = (units::parse(displacement)?, units::parse(unit)?);
    let target = match reference.rates_to(&known)? {
        0 => displacement.to_owned(),
        1 => format!("{displacement}/s"),
        _ => format!("{displacement}/s^2"),
    };
    Some((target, known.factor / reference.factor))
}

/// Brings each quantity of all records to one unit: that of the first displacement where it measures the same, else that
/// of the first record that gives one. A channel without a unit takes it, with a notice.
///
/// # Errors
/// Two records give one quantity in units that measure different things.
pub(super) fn unify(records: &mut [Record], file: &dyn Fn(&Record) -> String) -> Result<(), ReadError> {
    let first_unit = |role: Role| {
        records.iter().find_map(|r| {
            let channel = r.channel(role).filter(|c| !c.unit.is_empty())?;
            Some((file(r), channel.unit.clone()))
        })
    };
    let mut roles: Vec<Role> = records.iter().flat_map(|r| &r.channels).map(|c| c.role).collect();
    roles.sort_unstable();
    roles.dedup();
    let leading = first_unit(Role::Displacement(0));
    let references: Vec<(Role, String, String)> = roles
        .into_iter()
        .filter_map(|role| {
            let (origin, unit) = first_unit(role)?;
            let of_displacement = leading.as_ref().and_then(|(_, x)| derived(x, &unit));
            Some((role, origin, of_displacement.map_or(unit, |(target, _)| target)))
        })
        .collect();
    for record in records {
        let own = file(record);
        let mut told = Vec::new();
        for channel in &mut record.channels {
            let Some((_, origin, target)) = references.iter().find(|(role, ..)| *role == channel.role) else {
                continue;
            };
            if channel.unit == *target {
                continue;
            }
            let (noun, name) = (channel.role.noun(), channel.name.clone());
            if channel.unit.is_empty() {
                told.push(format!("{own}: {noun} `{name}` has no unit; it is taken to be in {target}, as in {origin}"));
                channel.unit.clone_from(target);
                continue;
            }
            let alike = units::parse(target).zip(units::parse(&channel.unit)).filter(|(a, b)| a.is_like(b));
            let Some(factor) = alike.map(|(to, from)| from.factor / to.factor) else {
                let (unit, other_unit) = (channel.unit.clone(), target.clone());
                let (quantity, column, other) = (noun, name, origin.clone());
                let problem = ReadProblem::UnitsDiffer { quantity, column, unit, other, other_unit };
                return Err(ReadError::new(own, problem));
            };
            if (factor - 1.0).abs() > 1e-12 {
                channel.values = channel.values.iter().map(|v| v * factor).collect();
                let unit = &channel.unit;
                told.push(format!(
                    "{own}: {noun} `{name}` was converted from {unit} to {target}, the unit in {origin}"
                ));
            }
            channel.unit.clone_from(target);
        }
        record.notices.extend(told);
    }
    Ok(())
}
