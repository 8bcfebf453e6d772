//! The program in a real window, and a user at it: sees pixels, moves the pointer, presses keys.

use std::process::{Child, Command, ExitStatus, Stdio};
use std::thread::sleep;
use std::time::{Duration, Instant};

use x11rb::connection::Connection;
use x11rb::protocol::xproto::{
    AtomEnum, BUTTON_PRESS_EVENT, BUTTON_RELEASE_EVENT, ClientMessageEvent, ConnectionExt as _, EventMask,
    ImageFormat, InputFocus, KEY_PRESS_EVENT, KEY_RELEASE_EVENT, MOTION_NOTIFY_EVENT, Window,
};
use x11rb::protocol::xtest::ConnectionExt as _;
use x11rb::rust_connection::RustConnection;
use x11rb::{CURRENT_TIME, NONE};

/// Nothing that works takes this long, on any machine.
const PATIENCE: Duration = Duration::from_secs(120);
/// A picture of what is set that stands still for this long is the last one: of what is set now, not a moment ago.
const STILL: Duration = Duration::from_millis(1500);
/// Between two looks.
const GLANCE: Duration = Duration::from_millis(100);
/// Pixels of the window's left part, which holds the controls.
const PANEL: usize = 390;
const SIZE: [usize; 2] = [640, 360];
/// Pixel in the middle of the stage.
const MIDDLE: [i16; 2] = [((PANEL + SIZE[0]) / 2) as i16, (SIZE[1] / 2) as i16];

/// The panel's mark of a picture that is not yet what is set.
const BEHIND: [u8; 3] = [255, 176, 0];

/// Keysyms of the keys that tests press; letters are their ASCII codes.
pub(crate) const SPACE: u32 = 0x20;
pub(crate) const HOME: u32 = 0xff50;

/// Pixels of the window.
#[derive(Clone, PartialEq, Eq)]
pub(crate) struct Shot {
    pixels: Vec<[u8; 3]>,
}

impl Shot {
    /// A part of every row.
    fn columns(&self, columns: std::ops::Range<usize>) -> Vec<[u8; 3]> {
        self.pixels.chunks_exact(SIZE[0]).flat_map(|row| row[columns.clone()].to_vec()).collect()
    }

    /// The picture's part.
    pub(crate) fn stage(&self) -> Vec<[u8; 3]> {
        self.columns(PANEL..SIZE[0])
    }

    /// The controls' part.
    pub(crate) fn panel(&self) -> Vec<[u8; 3]> {
        self.columns(0..PANEL)
    }

    /// Whether another picture is on its way.
    fn is_behind(&self) -> bool {
        self.panel().iter().any(|pixel| pixel.iter().zip(BEHIND).all(|(a, b)| a.abs_diff(b) <= 3))
    }
}

/// Share of pixels that differ visibly.
pub(crate) fn difference(a: &[[u8; 3]], b: &[[u8; 3]]) -> f64 {
    assert_eq!(a.len(), b.len());
    let differs = |(a, b): (&[u8; 3], &[u8; 3])| a.iter().zip(b).any(|(a, b)| a.abs_diff(*b) > 6);
    a.iter().zip(b).filter(|&pair| differs(pair)).count() as f64 / a.len() as f64
}

/// Whether pixels show a lit scene: neither black nor all alike.
pub(crate) fn is_picture(pixels: &[[u8; 3]]) -> bool {
    let mut colors: Vec<_> = pixels.to_vec();
    colors.sort_unstable();
    colors.dedup();
    let bright = pixels.iter().filter(|p| p.iter().any(|&c| c > 60)).count();
    colors.len() > 30 && bright * 20 > pixels.len()
}

/// A running viewer and the connection through which it is used.
pub(crate) struct Session {
    child: Child,
    x: RustConnection,
    root: Window,
    window: Window,
}

/// The program with arguments separated by blanks.
pub(crate) fn viewer(arguments: &str) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_spectral-viewer"));
    command
        .args(arguments.split_whitespace())
        .arg(format!("--size={}x{}", SIZE[0], SIZE[1]))
        .env("WINIT_X11_SCALE_FACTOR", "1")
        .env_remove("WAYLAND_DISPLAY")
        .env_remove("WAYLAND_SOCKET")
        .stdin(Stdio::null());
    command
}

impl Session {
    /// Open a window and wait for a picture in it.
    pub(crate) fn open(arguments: &str) -> Self {
        let (x, screen) = x11rb::connect(None).expect("DISPLAY names an X server");
        let root = x.setup().roots[screen].root;
        let child = viewer(arguments).spawn().expect("the viewer starts");
        let mut session = Self { child, x, root, window: NONE };
        session.window = session.wait_for("a window", |s| s.find_window());
        session.wait_for("a picture", |s| s.shot().filter(|shot| is_picture(&shot.stage())));
        // There is no window manager to do it, and a window that is not there yet takes no focus.
        let focus = session.x.set_input_focus(InputFocus::PARENT, session.window, CURRENT_TIME);
        focus.expect("sent").check().expect("the window takes the keyboard");
        session
    }

    /// The window whose title says what it is.
    fn find_window(&self) -> Option<Window> {
        let children = self.x.query_tree(self.root).ok()?.reply().ok()?.children;
        children.into_iter().find(|&window| {
            let name = self.x.get_property(false, window, AtomEnum::WM_NAME, AtomEnum::ANY, 0, 64);
            name.ok().and_then(|n| n.reply().ok()).is_some_and(|n| n.value.starts_with(b"spectral view"))
        })
    }

    /// What the window shows; none while it does not have its size or is not shown.
    pub(crate) fn shot(&self) -> Option<Shot> {
        let [width, height] = SIZE.map(|side| side as u16);
        let image = self.x.get_image(ImageFormat::Z_PIXMAP, self.window, 0, 0, width, height, !0);
        let data = image.ok()?.reply().ok()?.data;
        let pixels = data.as_chunks::<4>().0.iter().map(|&[b, g, r, _]| [r, g, b]).collect();
        Some(Shot { pixels })
    }

    /// The picture once it is of what is set and stands still for a while: panel times go on changing, the stage of a scene at
    /// rest does not.
    pub(crate) fn settled(&mut self) -> Vec<[u8; 3]> {
        let (mut before, mut since) = (Vec::new(), Instant::now());
        let settled = self.wait_for("the picture to stand still", |s| {
            let shot = s.shot()?;
            let now = shot.stage();
            if shot.is_behind() || difference_or_one(&before, &now) >= 1e-3 {
                since = Instant::now();
                before.clone_from(&now);
            }
            (since.elapsed() > STILL).then_some(now)
        });
        assert!(is_picture(&settled), "there is nothing to see");
        settled
    }

    /// The picture once more than `share` of it has changed from `before`, and stands still.
    pub(crate) fn changed(&mut self, what: &str, before: &[[u8; 3]], share: f64) -> Vec<[u8; 3]> {
        self.wait_for(what, |s| s.shot().filter(|now| difference(before, &now.stage()) > share));
        let now = self.settled();
        assert!(difference(before, &now) > share, "{what} went back");
        now
    }

    /// Look until there is something to see.
    pub(crate) fn wait_for<T>(&mut self, what: &str, mut look: impl FnMut(&Self) -> Option<T>) -> T {
        let begun = Instant::now();
        loop {
            if let Some(status) = self.child.try_wait().expect("a child") {
                panic!("the viewer ended ({status}) before there was {what}");
            }
            if let Some(seen) = look(self) {
                return seen;
            }
            assert!(begun.elapsed() < PATIENCE, "waited for {what} in vain");
            sleep(GLANCE);
        }
    }

    /// Click at so many pixels from the middle of the stage.
    pub(crate) fn click(&self, [right, down]: [i16; 2]) {
        let [x, y] = MIDDLE;
        self.point([x + right, y + down]);
        self.fake(BUTTON_PRESS_EVENT, 1);
        self.fake(BUTTON_RELEASE_EVENT, 1);
    }

    /// Drag from the middle of the stage by so many pixels, in steps as a hand does, and let go whether or not a frame has been
    /// drawn meanwhile.
    pub(crate) fn drag(
        &mut self,
        (button, by): (u8, [i16; 2]),
        what: &str,
        before: &[[u8; 3]],
        share: f64,
    ) -> Vec<[u8; 3]> {
        let from = MIDDLE;
        let steps = 8;
        self.point(from);
        self.fake(BUTTON_PRESS_EVENT, button);
        for step in 1..=steps {
            self.point([0, 1].map(|i| from[i] + by[i] * step / steps));
            sleep(GLANCE / 5);
        }
        self.fake(BUTTON_RELEASE_EVENT, button);
        self.changed(what, before, share)
    }

    fn point(&self, [x, y]: [i16; 2]) {
        let at = self
            .x
            .translate_coordinates(self.window, self.root, x, y)
            .expect("sent")
            .reply()
            .expect("a window");
        self.x
            .xtest_fake_input(MOTION_NOTIFY_EVENT, 0, CURRENT_TIME, self.root, at.dst_x, at.dst_y, 0)
            .expect("sent");
        self.x.flush().expect("sent");
    }

    /// Press the key of a keysym and let it go.
    pub(crate) fn press(&self, keysym: u32) {
        let setup = self.x.setup();
        let count = setup.max_keycode - setup.min_keycode + 1;
        let map =
            self.x.get_keyboard_mapping(setup.min_keycode, count).expect("sent").reply().expect("a keymap");
        let per_key = usize::from(map.keysyms_per_keycode);
        let place = map.keysyms.chunks(per_key).position(|syms| syms.contains(&keysym)).expect("such a key");
        let keycode = setup.min_keycode + place as u8;
        self.fake(KEY_PRESS_EVENT, keycode);
        self.fake(KEY_RELEASE_EVENT, keycode);
    }

    fn fake(&self, kind: u8, detail: u8) {
        self.x.xtest_fake_input(kind, detail, CURRENT_TIME, self.root, 0, 0, 0).expect("sent");
        self.x.flush().expect("sent");
    }

    /// Close the window as a window manager does, and see how the program ends.
    pub(crate) fn close(mut self) -> ExitStatus {
        let atom =
            |name: &[u8]| self.x.intern_atom(false, name).expect("sent").reply().expect("an atom").atom;
        let (protocols, delete) = (atom(b"WM_PROTOCOLS"), atom(b"WM_DELETE_WINDOW"));
        let message = ClientMessageEvent::new(32, self.window, protocols, [delete, CURRENT_TIME, 0, 0, 0]);
        self.x.send_event(false, self.window, EventMask::NO_EVENT, message).expect("sent");
        self.x.flush().expect("sent");
        let begun = Instant::now();
        loop {
            if let Some(status) = self.child.try_wait().expect("a child") {
                return status;
            }
            assert!(begun.elapsed() < PATIENCE, "the window does not close");
            sleep(GLANCE);
        }
    }
}

/// A test that failed leaves no window.
impl Drop for Session {
    fn drop(&mut self) {
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

fn difference_or_one(a: &[[u8; 3]], b: &[[u8; 3]]) -> f64 {
    if a.is_empty() { 1.0 } else { difference(a, b) }
}
