//! The files of the bodies of a run.

use std::path::{Path, PathBuf};

use super::{Moment, SOLIDS_FILE, Solids, write_bodies, write_contacts, write_walls};
use crate::output::OutputError;
use crate::output::frames::Frames;
use crate::output::pvd::Series;
use crate::output::timed::TimedTable;

/// Columns of `bodies.csv` after `time`.
const BODY_COLUMNS: [&str; 10] = ["body", "x", "y", "theta", "vx", "vy", "spin", "fx", "fy", "torque"];
/// More of them in a Stokes flow.
const FLOW_COLUMNS: [&str; 3] = ["flow_fx", "flow_fy", "flow_torque"];
/// Columns of `contacts.csv` after `time`.
const CONTACT_COLUMNS: [&str; 8] = ["body", "partner", "gap", "force", "gamma", "x", "y", "friction"];

/// What a run writes of its bodies.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct BodyOutputs {
    /// `bodies.pvd`, `contacts.pvd`, `bodies/*.vtp` and `bodies.csv`.
    pub bodies: bool,
    /// `contacts.csv`.
    pub contacts: bool,
    /// `frames.csv` and `frames-NAME.txt`.
    pub pictures: bool,
    /// What a flow does to bodies, in `bodies.csv`.
    pub flow: bool,
}

/// Writes what a run asks for: `bodies.json` where there are bodies, the rest as [`BodyOutputs`].
///
/// A moment is written once: a second call for the same step and time does nothing.
#[derive(Debug)]
pub struct BodyFiles {
    out: PathBuf,
    solids: Solids,
    /// Of the bodies and of the contacts.
    series: Option<[Series; 2]>,
    bodies: Option<TimedTable>,
    contacts: Option<TimedTable>,
    frames: Option<Frames>,
    /// Steps of the last polydata and of the last rows.
    last: [Option<usize>; 2],
}

impl BodyFiles {
    /// Opens the files of a run in its folder `out`; a run that is resumed at a time drops what was written after it.
    ///
    /// # Errors
    /// Folders or files that cannot be written, results that cannot be continued.
    pub fn new(out: &Path, solids: Solids, asked: BodyOutputs, resume: Option<f64>) -> Result<Self, OutputError> {
        let folder = out.join("bodies");
        if asked.bodies {
            make_folder(&folder)?;
        }
        if asked.pictures {
            make_folder(&out.join("plots"))?;
        }
        if !solids.bodies.is_empty() {
            solids.write(&out.join(SOLIDS_FILE))?;
        }
        let index = |name: &str| match resume {
            Some(t) => Series::resume(&out.join(name), t),
            None => Series::create(&out.join(name)),
        };
        let table = |wanted: bool, name: &str, columns: &[&str]| match (wanted, resume) {
            (false, _) => Ok(None),
            (true, Some(t)) => TimedTable::resume(&out.join(name), columns, t).map(Some),
            (true, None) => TimedTable::create(&out.join(name), columns).map(Some),
        };
        let more: &[&str] = if asked.flow { &FLOW_COLUMNS } else { &[] };
        Ok(Self {
            series: if asked.bodies { Some([index("bodies.pvd")?, index("contacts.pvd")?]) } else { None },
            bodies: table(asked.bodies, "bodies.csv", &[&BODY_COLUMNS, more].concat())?,
            contacts: table(asked.contacts, "contacts.csv", &CONTACT_COLUMNS)?,
            frames: match (asked.pictures, resume) {
                (false, _) => None,
                (true, Some(t)) => Some(Frames::resume(out, t)?),
                (true, None) => Some(Frames::create(out)?),
            },
            out: out.into(),
            solids,
            last: [None; 2],
        })
    }

    /// The bodies and walls.
    pub fn solids(&self) -> &Solids {
        &self.solids
    }

    /// Writes the polydata, their place in `bodies.pvd` and `contacts.pvd`, and the rows of the tables.
    ///
    /// # Errors
    /// [`OutputError::NonFiniteBody`] for a number that is not finite, [`OutputError::Io`] for files that cannot be
    /// written.
    pub fn write(&mut self, step: usize, moment: &Moment) -> Result<(), OutputError> {
        moment.check(&self.out.join("bodies.csv"))?;
        if self.last[1] == Some(step) {
            return Ok(());
        }
        if self.series.is_some() {
            let (t, parts) = (moment.time, self.parts(step, moment)?);
            let [bodies, contacts] = self.series.as_mut().expect("looked at above");
            // numbered from 0 in each index, and the walls beside the bodies
            let own = |of: &[usize]| {
                of.iter()
                    .filter_map(|k| parts.get(*k))
                    .enumerate()
                    .map(|(part, (_, file))| (part, file.clone()))
                    .collect()
            };
            let (first, second): (Vec<_>, Vec<_>) = (own(&[0, 2]), own(&[1]));
            bodies.append_parts(t, &first)?;
            contacts.append_parts(t, &second)?;
        }
        self.append_rows(moment)?;
        self.last[1] = Some(step);
        Ok(())
    }

    /// Writes the polydata if they are not there yet, and gives their parts for a series of fields, whose own part is
    /// 0: 1 for the bodies, 2 for the contacts and, where there are walls, 3 for them. To be handed to
    /// [`Series::append_parts`].
    ///
    /// # Errors
    /// [`OutputError::NonFiniteBody`] for a number that is not finite, [`OutputError::Io`] for files that cannot be
    /// written.
    pub fn parts(&mut self, step: usize, moment: &Moment) -> Result<Vec<(usize, String)>, OutputError> {
        let names = [format!("bodies/step-{step:06}.vtp"), format!("bodies/contacts-{step:06}.vtp")];
        let walls = (!self.solids.walls.is_empty()).then(|| "bodies/walls.vtp".to_owned());
        if self.last[0] != Some(step) {
            make_folder(&self.out.join("bodies"))?;
            write_bodies(&self.out.join(&names[0]), moment)?;
            write_contacts(&self.out.join(&names[1]), moment)?;
            if let Some(name) = &walls {
                write_walls(&self.out.join(name), &self.solids.walls)?;
            }
            self.last[0] = Some(step);
        }
        Ok(names.into_iter().chain(walls).enumerate().map(|(k, name)| (k + 1, name)).collect())
    }

    /// Notes a picture `<NAME>-<step>` that was drawn in `plots/`, where pictures were asked for.
    ///
    /// # Errors
    /// [`OutputError::Io`] if the list of pictures cannot be written.
    pub fn note_picture(&mut self, name: &str, step: usize, time: f64) -> Result<(), OutputError> {
        match &mut self.frames {
            Some(frames) => frames.append(name, &format!("plots/{name}-{step:06}.png"), time),
            None => Ok(()),
        }
    }

    /// Where the picture of a name and step belongs, without its ending.
    pub fn picture_path(&self, name: &str, step: usize) -> PathBuf {
        self.out.join("plots").join(format!("{name}-{step:06}"))
    }

    fn append_rows(&mut self, moment: &Moment) -> Result<(), OutputError> {
        if let Some(table) = &mut self.bodies {
            let rows = moment.solids.bodies.iter().enumerate().map(|(k, member)| {
                let (pose, twist, load) = (&moment.poses[k], &moment.twists[k], &moment.loads[k]);
                let (x, v, f) = (pose.position, twist.velocity, load.force);
                let mut numbers = vec![x.x, x.y, pose.angle, v.x, v.y, twist.spin, f.x, f.y, load.torque];
                if let Some(flow) = moment.flow.get(k) {
                    numbers.extend([flow.force.x, flow.force.y, flow.torque]);
                }
                (vec![member.name.as_str()], numbers)
            });
            table.append(moment.time, rows)?;
        }
        if let Some(table) = &mut self.contacts {
            let partners: Vec<String> = moment.contacts.iter().map(|contact| moment.partner(contact)).collect();
            let rows = moment.contacts.iter().zip(&partners).map(|(contact, partner)| {
                let crate::contact::Contact { gap, force, friction, gamma, point, .. } = *contact;
                let numbers = vec![gap, force, gamma, point.x, point.y, friction];
                (vec![moment.solids.bodies[contact.body].name.as_str(), partner.as_str()], numbers)
            });
            table.append(moment.time, rows)?;
        }
        Ok(())
    }
}

fn make_folder(path: &Path) -> Result<(), OutputError> {
    std::fs::create_dir_all(path).map_err(|e| OutputError::io(path, &e))
}
