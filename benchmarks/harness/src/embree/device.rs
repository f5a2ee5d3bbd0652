//! A device, and scenes that are built on it.

use std::ffi::{CString, c_int};
use std::path::Path;
use std::ptr::null_mut;
use std::sync::atomic::{AtomicIsize, Ordering};

use super::library::{Functions, Handle};
use super::trace::EmbreeScene;
use crate::mesh::Mesh;

/// Bytes that Embree holds now, and the most it has held since `reset_peak`.
static HELD: AtomicIsize = AtomicIsize::new(0);
static PEAK: AtomicIsize = AtomicIsize::new(0);

extern "C" fn monitor(_: Handle, bytes: isize, _: bool) -> bool {
    let held = HELD.fetch_add(bytes, Ordering::Relaxed) + bytes;
    PEAK.fetch_max(held, Ordering::Relaxed);
    true
}

/// One at a time: a second one would share the first one's threads.
pub struct Device {
    pub(super) functions: Functions,
    handle: Handle,
}

// SAFETY: Embree's devices may be used from any thread.
unsafe impl Sync for Device {}

impl Device {
    /// With `threads` build threads, the calling one among them, from the folder of the wheel's libraries.
    pub fn new(folder: &Path, threads: usize) -> Result<Self, String> {
        let functions = Functions::load(folder)?;
        let settings = CString::new(format!("threads={threads}")).expect("no zero in a number");
        // SAFETY: the string ends in a zero and outlives the call; the monitor has the signature that is asked for.
        let (handle, error) = unsafe {
            let handle = (functions.new_device)(settings.as_ptr());
            (functions.set_memory_monitor)(handle, monitor, null_mut());
            (handle, (functions.device_error)(handle))
        };
        if error == 0 { Ok(Self { functions, handle }) } else { Err(format!("Embree's error {error}")) }
    }

    /// Embree's own version, such as 40400.
    pub fn version(&self) -> isize {
        // SAFETY: the device lives; 0 is RTC_DEVICE_PROPERTY_VERSION.
        unsafe { (self.functions.device_property)(self.handle, 0) }
    }
}

impl Drop for Device {
    fn drop(&mut self) {
        // SAFETY: scenes borrow the device, so none is left.
        unsafe { (self.functions.release_device)(self.handle) };
    }
}

pub struct EmbreeSide<'a> {
    device: &'a Device,
    quality: c_int,
    flags: c_int,
}

impl<'a> EmbreeSide<'a> {
    pub fn parse(words: &[&str], device: &'a Device) -> Result<Self, String> {
        let [quality, flags @ ..] = words else { return Err("low, medium or high".to_owned()) };
        let quality = match *quality {
            "low" => 0,
            "medium" => 1,
            "high" => 2,
            _ => return Err(format!("no quality {quality:?}")),
        };
        let flags = flags.iter().try_fold(0, |flags, &flag| match flag {
            "compact" => Ok(flags | 2),
            "robust" => Ok(flags | 4),
            _ => Err(format!("no flag {flag:?}")),
        })?;
        Ok(Self { device, quality, flags })
    }

    /// From the calling thread, on the threads of the device.
    pub fn build<'m>(&'m self, mesh: &'m Mesh) -> EmbreeScene<'m> {
        const TRIANGLES: c_int = 0;
        const INDICES: (c_int, c_int) = (0, 0x5003);
        const VERTICES: (c_int, c_int) = (1, 0x9003);
        let functions = &self.device.functions;
        let before = HELD.load(Ordering::Relaxed);
        PEAK.store(before, Ordering::Relaxed);
        // SAFETY: the device lives as long as the scene; both buffers outlive it, hold rows of 12 bytes, and the last
        // vertex ends the vector, which Embree reads 16 bytes of: `Mesh` keeps a spare row behind it.
        let (handle, error) = unsafe {
            let scene = (functions.new_scene)(self.device.handle);
            (functions.set_scene_flags)(scene, self.flags);
            (functions.set_scene_quality)(scene, self.quality);
            let geometry = (functions.new_geometry)(self.device.handle, TRIANGLES);
            let set = functions.set_shared_buffer;
            let (rows, vertices) = (&mesh.triangles, mesh.vertices());
            set(geometry, INDICES.0, 0, INDICES.1, rows.as_ptr().cast(), 0, 12, rows.len());
            set(geometry, VERTICES.0, 0, VERTICES.1, vertices.as_ptr().cast(), 0, 12, vertices.len());
            // A scene of low quality builds each geometry by the geometry's own.
            (functions.set_geometry_quality)(geometry, self.quality);
            (functions.commit_geometry)(geometry);
            (functions.attach_geometry)(scene, geometry);
            (functions.release_geometry)(geometry);
            (functions.commit_scene)(scene);
            (scene, (functions.device_error)(self.device.handle))
        };
        assert_eq!(error, 0, "Embree's error");
        EmbreeScene {
            functions,
            handle,
            bytes: bytes(HELD.load(Ordering::Relaxed) - before),
            peak_bytes: bytes(PEAK.load(Ordering::Relaxed) - before),
        }
    }
}

fn bytes(difference: isize) -> usize {
    usize::try_from(difference).unwrap_or(0)
}
