//! Which column is which: what the user says first, then what the header says.

use super::error::{ReadError, ReadProblem, doubtful_notice};
use super::heading::{ColumnKey, ColumnQuantity, Heading, Meaning, label};
use super::options::ReadOptions;
use super::words::list;
use sindyscope_values::record::Role;
use sindyscope_values::record::units;
use sindyscope_values::term::Kind;

/// The columns that are read, by position from zero.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct Selection {
    pub(super) time: Option<usize>,
    pub(super) trajectory: Option<usize>,
    /// Each channel's role and column, sorted by role.
    pub(super) channels: Vec<(Role, usize)>,
    /// What the user should know of the choice.
    pub(super) notices: Vec<String>,
}

/// What each column is taken for as things stand, also where that is not enough to read the file or contradicts itself.
pub(super) fn taken(headings: &[Heading], options: &ReadOptions) -> Vec<Option<ColumnKey>> {
    let mut assignment =
        Assignment { file: "", headings, options, taken: vec![None; headings.len()], notices: Vec::new() };
    for (key, name) in options.columns.assigned() {
        if let Ok(column) = assignment.find(key, name) {
            assignment.taken[column] = Some(key);
        }
    }
    let quantities = [
        ColumnQuantity::Time,
        ColumnQuantity::Trajectory,
        ColumnQuantity::Displacement,
        ColumnQuantity::Velocity,
        ColumnQuantity::Acceleration,
        ColumnQuantity::Input,
    ];
    for quantity in quantities {
        assignment.columns(quantity);
    }
    if !assignment.taken.iter().flatten().any(|key| key.quantity.is_motion()) {
        assignment.accelerations_by_unit();
    }
    if !assignment.taken.iter().flatten().any(|key| key.quantity == ColumnQuantity::Input) {
        assignment.force_by_unit();
    }
    assignment.taken
}

/// Decides which column is which.
pub(super) fn assign(file: &str, headings: &[Heading], options: &ReadOptions) -> Result<Selection, ReadError> {
    Assignment { file, headings, options, taken: vec![None; headings.len()], notices: Vec::new() }.run()
}

/// Channels of motion that are studied together at most: beyond it a library has more terms than any record tells.
const MOST_MOTIONS: usize = 64;

struct Assignment<'a> {
    file: &'a str,
    headings: &'a [Heading],
    options: &'a ReadOptions,
    /// What each column is taken for.
    taken: Vec<Option<ColumnKey>>,
    notices: Vec<String>,
}

impl Assignment<'_> {
    fn run(mut self) -> Result<Selection, ReadError> {
        self.take_mapped()?;
        let time = self.single(ColumnQuantity::Time)?;
        let trajectory = self.single(ColumnQuantity::Trajectory)?;
        let mut displacements = self.numbered(ColumnQuantity::Displacement)?;
        self.add_coordinates(&mut displacements);
        let velocities = self.numbered(ColumnQuantity::Velocity)?;
        let mut accelerations = self.numbered(ColumnQuantity::Acceleration)?;
        if displacements.is_empty() && velocities.is_empty() && accelerations.is_empty() {
            accelerations = self.accelerations_by_unit();
        }
        let mut inputs = self.numbered(ColumnQuantity::Input)?;
        if inputs.is_empty() {
            inputs = self.force_by_unit();
        }
        let second_order = self.options.kind == Kind::SecondOrder;
        if displacements.is_empty() && velocities.is_empty() && (accelerations.is_empty() || !second_order) {
            let doubtful = self.headings.iter().filter_map(|h| match &h.meaning {
                Meaning::Doubtful(key, why) if key.quantity != ColumnQuantity::Time => {
                    Some((h.name.clone(), why.clone()))
                }
                _ => None,
            });
            return Err(
                self.refused(ReadProblem::NoDisplacement { columns: self.names(), doubtful: doubtful.collect() })
            );
        }
        let motions = [&displacements, &velocities, &accelerations];
        let count = motions.iter().map(|m| m.len()).sum();
        if count > MOST_MOTIONS {
            let first = motions.iter().find_map(|m| m.first()).map_or(String::new(), |(_, column)| self.name(*column));
            let columns = self.names();
            return Err(self.refused(ReadProblem::TooManyMotions { count, first, columns, most: MOST_MOTIONS }));
        }
        let time = match (time, self.options.rate) {
            (None, None) => {
                return Err(self.refused(ReadProblem::NoTime(self.names())));
            }
            (Some(column), Some(rate)) => {
                let name = self.name(column);
                self.notices
                    .push(format!("the sampling rate given, {rate} Hz, counts; the time column `{name}` does not"));
                None
            }
            (time, None) => time,
            (None, Some(_)) => None,
        };

        // A degree of freedom may be measured in any way.
        let mut moving = displacements.clone();
        if second_order || displacements.is_empty() {
            for (number, column) in velocities.iter().chain(accelerations.iter().filter(|_| second_order)) {
                if moving.iter().all(|(known, _)| known != number) {
                    moving.push((*number, *column));
                }
            }
        }
        moving.sort_unstable();
        self.in_sequence(&moving)?;
        self.in_sequence(&inputs)?;
        let mut channels: Vec<(Role, usize)> = Vec::new();
        let freedoms = displacements.len();
        channels.extend(displacements.iter().map(|(number, column)| (Role::Displacement(number - 1), *column)));
        if !second_order {
            for (i, (_, column)) in velocities.iter().enumerate() {
                self.notices.push(format!("the velocity `{}` is state x{}", self.name(*column), freedoms + i + 1));
                channels.push((Role::Displacement(freedoms + i), *column));
            }
            for (_, column) in &accelerations {
                self.taken[*column] = None;
            }
        } else {
            type MakeRole = fn(usize) -> Role;
            for (of, role) in [(velocities, Role::Velocity as MakeRole), (accelerations, Role::Acceleration)] {
                channels.extend(of.into_iter().map(|(number, column)| (role(number - 1), column)));
            }
        }
        channels.extend(inputs.iter().enumerate().map(|(j, (_, column))| (Role::Input(j), *column)));
        channels.sort_by_key(|(role, _)| *role);
        self.tell_unused();
        Ok(Selection { time, trajectory, channels, notices: self.notices })
    }

    fn name(&self, column: usize) -> String {
        label(self.headings, column)
    }

    fn names(&self) -> Vec<String> {
        (0..self.headings.len()).map(|c| self.name(c)).collect()
    }

    /// Columns that the user has named.
    fn take_mapped(&mut self) -> Result<(), ReadError> {
        for (key, name) in self.options.columns.assigned() {
            let column = self.find(key, name)?;
            if let Some(first) = self.taken[column] {
                return Err(self.refused(ReadProblem::ColumnUsedTwice {
                    column: self.name(column),
                    first: first.to_string(),
                    second: key.to_string(),
                }));
            }
            self.taken[column] = Some(key);
        }
        Ok(())
    }

    /// The column of a name: as it stands, else in any case, else without its unit, else by number.
    fn find(&self, key: ColumnKey, name: &str) -> Result<usize, ReadError> {
        let lower = name.to_lowercase();
        let ways: [&dyn Fn(&Heading) -> bool; 3] = [&|h| h.name == name, &|h| h.name.to_lowercase() == lower, &|h| {
            !h.stem.is_empty() && h.stem.to_lowercase() == lower
        }];
        for way in ways {
            let found: Vec<usize> = (0..self.headings.len()).filter(|&c| way(&self.headings[c])).collect();
            match found[..] {
                [] => {}
                [column] => return Ok(column),
                _ => {
                    return Err(self.refused(ReadProblem::AmbiguousColumn {
                        key: key.to_string(),
                        name: name.to_owned(),
                        count: found.len(),
                    }));
                }
            }
        }
        match name.parse::<usize>() {
            Ok(number) if (1..=self.headings.len()).contains(&number) => Ok(number - 1),
            _ => Err(self.refused(ReadProblem::UnknownColumn {
                key: key.to_string(),
                name: name.to_owned(),
                columns: self.names(),
            })),
        }
    }

    /// Columns of a quantity: those that the user named, and those of the header that do not stand against them.
    fn columns(&mut self, quantity: ColumnQuantity) -> Vec<(Option<usize>, usize)> {
        let of_quantity = |key: &ColumnKey| key.quantity == quantity;
        let mapped: Vec<(Option<usize>, usize)> = (0..self.taken.len())
            .filter_map(|c| self.taken[c].filter(of_quantity).map(|key| (key.number, c)))
            .collect();
        let mut all = mapped.clone();
        // `x=NAME` speaks of the only one, `x2=NAME` of the second.
        if !self.options.only_named && !mapped.iter().any(|(number, _)| number.is_none()) {
            for (column, heading) in self.headings.iter().enumerate() {
                if let Meaning::Known(key) = heading.meaning
                    && of_quantity(&key)
                    && self.taken[column].is_none()
                    && !mapped.iter().any(|(number, _)| *number == Some(key.number.unwrap_or(1)))
                {
                    self.taken[column] = Some(key);
                    all.push((key.number, column));
                }
            }
        }
        all.sort_unstable();
        all
    }

    fn refused(&self, problem: ReadProblem) -> ReadError {
        ReadError::new(self.file, problem)
    }

    fn conflict(&self, key: ColumnKey, first: usize, second: usize) -> ReadError {
        self.refused(ReadProblem::TwoColumns {
            key: key.to_string(),
            first: self.name(first),
            second: self.name(second),
            numbers: (first + 1, second + 1),
        })
    }

    fn single(&mut self, quantity: ColumnQuantity) -> Result<Option<usize>, ReadError> {
        match self.columns(quantity)[..] {
            [] => Ok(None),
            [(_, column)] => Ok(Some(column)),
            [(_, first), (_, second), ..] => Err(self.conflict(ColumnKey { quantity, number: None }, first, second)),
        }
    }

    /// Columns of a quantity with their numbers from 1.
    fn numbered(&mut self, quantity: ColumnQuantity) -> Result<Vec<(usize, usize)>, ReadError> {
        let all = self.columns(quantity);
        let from_zero = usize::from(all.iter().any(|(number, _)| *number == Some(0)));
        let plain: Vec<usize> = all.iter().filter(|(number, _)| number.is_none()).map(|(_, c)| *c).collect();
        let mut numbered: Vec<(usize, usize)> =
            all.iter().filter_map(|(number, c)| Some((number.as_ref()?.saturating_add(from_zero), *c))).collect();
        match plain[..] {
            [] => {}
            [column] => numbered.push((1, column)),
            // A force and a base motion are two inputs, though neither has a number.
            [first, second]
                if quantity == ColumnQuantity::Input && numbered.is_empty() && self.words_differ(first, second) =>
            {
                numbered = vec![(1, first), (2, second)];
                let (first, second) = (self.name(first), self.name(second));
                self.notices.push(format!("`{first}` is input u1 and `{second}` is input u2"));
            }
            [first, second, ..] => return Err(self.conflict(ColumnKey { quantity, number: None }, first, second)),
        }
        numbered.sort_unstable();
        if let Some(pair) = numbered.windows(2).find(|w| w[0].0 == w[1].0) {
            let number = Some(pair[0].0);
            return Err(self.conflict(ColumnKey { quantity, number }, pair[0].1, pair[1].1));
        }
        Ok(numbered)
    }

    /// True if the two names start with different words.
    fn words_differ(&self, first: usize, second: usize) -> bool {
        let word = |column: usize| -> String {
            self.headings[column].stem.chars().take_while(|c| c.is_alphanumeric()).collect::<String>().to_lowercase()
        };
        word(first) != word(second)
    }

    /// `y` and `z` of a first-order system whose states are written `x, y, z`.
    fn add_coordinates(&mut self, displacements: &mut Vec<(usize, usize)>) {
        let numbered = displacements.iter().any(|(_, c)| self.taken[*c].is_some_and(|key| key.number.is_some()));
        if self.options.kind != Kind::FirstOrder || numbered || self.options.only_named {
            return;
        }
        for (column, heading) in self.headings.iter().enumerate() {
            if heading.meaning == Meaning::Coordinate && self.taken[column].is_none() {
                let number = Some(displacements.len() + 1);
                self.taken[column] = Some(ColumnKey { quantity: ColumnQuantity::Displacement, number });
                displacements.push((displacements.len() + 1, column));
            }
        }
    }

    /// Where no name speaks of a motion: the columns whose unit is that of an acceleration, numbered from 1.
    fn accelerations_by_unit(&mut self) -> Vec<(usize, usize)> {
        if self.options.kind != Kind::SecondOrder {
            return Vec::new();
        }
        let columns = self.untaken(|unit| units::parse(unit).is_some_and(|unit| unit.is_acceleration()));
        self.take_by_unit(columns, ColumnQuantity::Acceleration)
    }

    /// Where no name speaks of an input: the one column whose unit is that of a force or torque. Of several one may be a reaction.
    fn force_by_unit(&mut self) -> Vec<(usize, usize)> {
        // A joule has the torque's dimension and is none.
        let says = |unit: &str| !unit.contains('J') && units::parse(unit).is_some_and(|unit| unit.is_force());
        let columns = self.untaken(says);
        if columns.len() == 1 { self.take_by_unit(columns, ColumnQuantity::Input) } else { Vec::new() }
    }

    /// Columns that are not taken and whose unit says something.
    fn untaken(&self, says: impl Fn(&str) -> bool) -> Vec<usize> {
        let fits = |c: &usize| self.taken[*c].is_none() && says(&self.headings[*c].unit);
        if self.options.only_named { Vec::new() } else { (0..self.headings.len()).filter(fits).collect() }
    }

    fn take_by_unit(&mut self, columns: Vec<usize>, quantity: ColumnQuantity) -> Vec<(usize, usize)> {
        let numbered: Vec<(usize, usize)> =
            columns.into_iter().enumerate().map(|(i, column)| (i + 1, column)).collect();
        for (number, column) in &numbered {
            let key = ColumnKey { quantity, number: Some(*number) };
            self.taken[*column] = Some(key);
            let (name, unit, noun) = (self.name(*column), &self.headings[*column].unit, quantity.noun());
            self.notices.push(format!("`{name}` is taken for {noun} {key}, as its unit {unit} says"));
        }
        numbered
    }

    fn in_sequence(&self, numbered: &[(usize, usize)]) -> Result<(), ReadError> {
        match numbered.iter().enumerate().find(|(i, (number, _))| *number != i + 1) {
            None => Ok(()),
            Some((i, (_, column))) => {
                let quantity = self.taken[*column].map_or(ColumnQuantity::Displacement, |key| key.quantity);
                Err(self.refused(ReadProblem::NumberMissing {
                    column: self.name(*column),
                    key: ColumnKey { quantity, number: Some(i + 1) }.to_string(),
                }))
            }
        }
    }

    fn tell_unused(&mut self) {
        // Whoever named all that counts has seen the others.
        if self.options.only_named {
            return;
        }
        let mut unused = Vec::new();
        for column in (0..self.headings.len()).filter(|&c| self.taken[c].is_none()) {
            let heading = &self.headings[column];
            match &heading.meaning {
                Meaning::Doubtful(key, why) => self.notices.push(doubtful_notice(&heading.name, *key, why)),
                _ if heading.name.is_empty() => {}
                _ => unused.push(heading.name.as_str()),
            }
        }
        match unused.len() {
            0 => {}
            1 => self.notices.push(format!("column {} is not used", list(&unused))),
            _ => self.notices.push(format!("columns {} are not used", list(&unused))),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn choose(header: &str, columns: &str, kind: Kind) -> Result<(String, Vec<String>), ReadError> {
        let headings: Vec<Heading> = header.split(';').map(|name| Heading::new(name, None)).collect();
        let options = ReadOptions { columns: columns.parse().unwrap(), kind, ..ReadOptions::default() };
        let selection = assign("f", &headings, &options)?;
        let mut text = format!("t{}", selection.time.unwrap());
        for (role, column) in &selection.channels {
            let (symbol, i) = match role {
                Role::Displacement(i) => ("x", i),
                Role::Velocity(i) => ("v", i),
                Role::Acceleration(i) => ("a", i),
                Role::Input(i) => ("u", i),
            };
            text += &format!(" {symbol}{}={column}", i + 1);
        }
        if let Some(column) = selection.trajectory {
            text += &format!(" r{column}");
        }
        Ok((text, selection.notices))
    }

    #[test]
    fn columns_are_found_by_header_and_map() {
        use Kind::{FirstOrder, SecondOrder};
        for (header, map, kind, want) in [
            ("t;x;u", "", SecondOrder, "t0 x1=1 u1=2"),
            ("t_s;u_base_m;x_mass_m", "", SecondOrder, "t0 x1=2 u1=1"),
            ("run;Time [ms];X2;X1;v1;a2;Force (N)", "", SecondOrder, "t1 x1=3 x2=2 v1=4 a2=5 u1=6 r0"),
            ("t_s;V1_in_V;V2_out_V", "x=V2_out_V,u=V1_in_V", SecondOrder, "t0 x1=2 u1=1"),
            ("t_s;V1_in_V;V2_out_V", "x=v2_out,u=2", SecondOrder, "t0 x1=2 u1=1"),
            ("time;pos, mm;x", "x=pos, mm,t=time", SecondOrder, "t0 x1=1"),
            ("t;x0;x1;u0", "", SecondOrder, "t0 x1=1 x2=2 u1=3"),
            ("t;x;x2", "", SecondOrder, "t0 x1=1 x2=2"),
            ("t;x;base;force", "", SecondOrder, "t0 x1=1 u1=2 u2=3"),
            ("t;x;left;right", "u1=left,u2=right", SecondOrder, "t0 x1=1 u1=2 u2=3"),
            ("t;x1;x2;b", "x2=b", SecondOrder, "t0 x1=1 x2=3"),
            ("t;x;y;z", "", FirstOrder, "t0 x1=1 x2=2 x3=3"),
            ("t;x;y;z", "", SecondOrder, "t0 x1=1"),
            ("t;x1;x2;y", "", FirstOrder, "t0 x1=1 x2=2"),
            ("t;x;v;a;u", "", FirstOrder, "t0 x1=1 x2=2 u1=4"),
            ("t;x;v2", "", SecondOrder, "t0 x1=1 v2=2"),
            ("t;a;u", "", SecondOrder, "t0 a1=1 u1=2"),
            ("t;a1;v2", "", SecondOrder, "t0 v2=2 a1=1"),
            ("t;x;M [N m]", "", SecondOrder, "t0 x1=1 u1=2"),
            ("t;x;load (kN)", "", SecondOrder, "t0 x1=1 u1=2"),
            ("t;x;load (kN);reaction (kN)", "", SecondOrder, "t0 x1=1"),
            ("t;x;u;load (kN)", "", SecondOrder, "t0 x1=1 u1=2"),
            ("t;x;energy (J)", "", SecondOrder, "t0 x1=1"),
        ] {
            assert_eq!(choose(header, map, kind).unwrap().0, want, "{header} {map}");
        }
    }

    #[test]
    fn what_is_left_out_is_told() {
        for (header, kind, want) in [
            ("t;x;temp", Kind::SecondOrder, "column `temp` is not used"),
            ("t;x;p;q", Kind::SecondOrder, "columns `p` and `q` are not used"),
            (
                "t;x;v_V",
                Kind::SecondOrder,
                "column `v_V` is not taken for a velocity: its unit `V` is not that of a velocity; if it is one, say which column is which: v=v_V",
            ),
            ("t;x;load (kN)", Kind::SecondOrder, "`load (kN)` is taken for input u1, as its unit kN says"),
            ("t;x;base;force", Kind::SecondOrder, "`base` is input u1 and `force` is input u2"),
            ("t;x;v", Kind::FirstOrder, "the velocity `v` is state x2"),
        ] {
            assert_eq!(choose(header, "", kind).unwrap().1, [want], "{header}");
        }
    }
}
