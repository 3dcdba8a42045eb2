//! What drawing the fields of a flow takes beside the flow.

use std::cell::OnceCell;

use crate::measure::StreamFunction;
use crate::mesh::locate::Locator;
use crate::output::bodies::Moment;
use crate::output::plot::map::Picture;
use crate::run::RunError;
use crate::run::maps::{Caption, Draft, Source};
use crate::scene::MapRequest;

/// Made of it when it is first needed.
#[derive(Debug)]
pub struct MapTools {
    caption: Caption,
    locator: OnceCell<Locator>,
    stream: OnceCell<StreamFunction>,
}

impl MapTools {
    pub fn new(caption: Caption) -> Self {
        Self { caption, locator: OnceCell::new(), stream: OnceCell::new() }
    }

    /// The picture that was asked for, with the bodies above the fields.
    ///
    /// # Errors
    /// As [`Draft::draw`].
    pub fn draw(&self, source: Source, moment: &Moment, request: &MapRequest) -> Result<Picture, RunError> {
        self.draft(source, moment, request)?.draw(request, &self.caption)
    }

    /// The smallest and the largest value that the picture would show.
    ///
    /// # Errors
    /// As [`Draft::extent`].
    pub fn extent(&self, source: Source, moment: &Moment, request: &MapRequest) -> Result<[f64; 2], RunError> {
        self.draft(source, moment, request)?.extent(request, &self.caption)
    }

    fn draft<'s>(
        &'s self,
        source: Source<'s>,
        moment: &'s Moment<'s>,
        request: &MapRequest,
    ) -> Result<Draft<'s>, RunError> {
        let loops = source.loops();
        if request.streamlines && self.stream.get().is_none() {
            let stream = StreamFunction::new(loops, &source.velocity().space)?;
            self.stream.set(stream).expect("it was not there");
        }
        let locator = self.locator.get_or_init(|| Locator::new(&loops.mesh));
        let bodies = (!moment.solids.bodies.is_empty()).then_some(moment);
        Ok(Draft { source, locator, t: moment.time, stream: self.stream.get(), bodies })
    }
}
