//! The functions of Embree 4 that are called, by the signatures of its manual.

use std::ffi::{c_char, c_int, c_uint, c_void};
use std::fs;
use std::mem::forget;
use std::path::{Path, PathBuf};

use libloading::os::unix::{Library, RTLD_GLOBAL, RTLD_NOW, Symbol};

pub type Handle = *mut c_void;
pub type MemoryMonitor = extern "C" fn(Handle, isize, bool) -> bool;
type Intersect1 = unsafe extern "C" fn(Handle, *mut c_void, *mut Arguments);
type IntersectPacket = unsafe extern "C" fn(*const c_int, Handle, *mut c_void, *mut Arguments);
type SetSharedBuffer = unsafe extern "C" fn(Handle, c_int, c_uint, c_int, *const c_void, usize, usize, usize);

/// RTCIntersectArguments and RTCOccludedArguments.
#[repr(C)]
pub struct Arguments {
    pub flags: c_int,
    pub feature_mask: c_uint,
    pub context: Handle,
    pub filter: Handle,
    pub intersect: Handle,
}

impl Arguments {
    const COHERENT: c_int = 1 << 16;

    pub fn new(is_coherent: bool) -> Self {
        let none = std::ptr::null_mut();
        let flags = if is_coherent { Self::COHERENT } else { 0 };
        Self { flags, feature_mask: c_uint::MAX, context: none, filter: none, intersect: none }
    }
}

pub struct Functions {
    pub new_device: unsafe extern "C" fn(*const c_char) -> Handle,
    pub device_error: unsafe extern "C" fn(Handle) -> c_int,
    pub device_property: unsafe extern "C" fn(Handle, c_int) -> isize,
    pub release_device: unsafe extern "C" fn(Handle),
    pub set_memory_monitor: unsafe extern "C" fn(Handle, MemoryMonitor, Handle),
    pub new_scene: unsafe extern "C" fn(Handle) -> Handle,
    pub set_scene_flags: unsafe extern "C" fn(Handle, c_int),
    pub set_scene_quality: unsafe extern "C" fn(Handle, c_int),
    pub commit_scene: unsafe extern "C" fn(Handle),
    pub release_scene: unsafe extern "C" fn(Handle),
    pub new_geometry: unsafe extern "C" fn(Handle, c_int) -> Handle,
    pub set_shared_buffer: SetSharedBuffer,
    pub set_geometry_quality: unsafe extern "C" fn(Handle, c_int),
    pub commit_geometry: unsafe extern "C" fn(Handle),
    pub attach_geometry: unsafe extern "C" fn(Handle, Handle) -> c_uint,
    pub release_geometry: unsafe extern "C" fn(Handle),
    pub intersect_1: Intersect1,
    pub intersect_8: IntersectPacket,
    pub intersect_16: IntersectPacket,
    pub occluded_1: Intersect1,
    pub occluded_8: IntersectPacket,
    pub occluded_16: IntersectPacket,
}

impl Functions {
    /// From the folder of the wheel's libraries. They stay loaded.
    pub fn load(folder: &Path) -> Result<Self, String> {
        // Embree names TBB by the wheel's own file name; found once, it is taken from what is loaded.
        forget(open(&find(folder, "libtbb")?)?);
        let library = open(&find(folder, "libembree4")?)?;
        // SAFETY: the types are those of Embree's manual for these names.
        let functions = unsafe {
            Self {
                new_device: symbol(&library, "rtcNewDevice")?,
                device_error: symbol(&library, "rtcGetDeviceError")?,
                device_property: symbol(&library, "rtcGetDeviceProperty")?,
                release_device: symbol(&library, "rtcReleaseDevice")?,
                set_memory_monitor: symbol(&library, "rtcSetDeviceMemoryMonitorFunction")?,
                new_scene: symbol(&library, "rtcNewScene")?,
                set_scene_flags: symbol(&library, "rtcSetSceneFlags")?,
                set_scene_quality: symbol(&library, "rtcSetSceneBuildQuality")?,
                commit_scene: symbol(&library, "rtcCommitScene")?,
                release_scene: symbol(&library, "rtcReleaseScene")?,
                new_geometry: symbol(&library, "rtcNewGeometry")?,
                set_shared_buffer: symbol(&library, "rtcSetSharedGeometryBuffer")?,
                set_geometry_quality: symbol(&library, "rtcSetGeometryBuildQuality")?,
                commit_geometry: symbol(&library, "rtcCommitGeometry")?,
                attach_geometry: symbol(&library, "rtcAttachGeometry")?,
                release_geometry: symbol(&library, "rtcReleaseGeometry")?,
                intersect_1: symbol(&library, "rtcIntersect1")?,
                intersect_8: symbol(&library, "rtcIntersect8")?,
                intersect_16: symbol(&library, "rtcIntersect16")?,
                occluded_1: symbol(&library, "rtcOccluded1")?,
                occluded_8: symbol(&library, "rtcOccluded8")?,
                occluded_16: symbol(&library, "rtcOccluded16")?,
            }
        };
        forget(library);
        Ok(functions)
    }
}

fn find(folder: &Path, stem: &str) -> Result<PathBuf, String> {
    let entries = fs::read_dir(folder).map_err(|error| format!("{}: {error}", folder.display()))?;
    let mut paths = entries.filter_map(|entry| Some(entry.ok()?.path()));
    let is_it = |path: &PathBuf| path.file_name().is_some_and(|name| name.to_string_lossy().starts_with(stem));
    paths.find(is_it).ok_or_else(|| format!("{}: no {stem}", folder.display()))
}

fn open(path: &Path) -> Result<Library, String> {
    // SAFETY: the initialisers of Embree and TBB set up their own state only.
    unsafe { Library::open(Some(path), RTLD_NOW | RTLD_GLOBAL) }.map_err(|error| error.to_string())
}

/// # Safety
/// `T` is the type of the function.
unsafe fn symbol<T: Copy>(library: &Library, name: &str) -> Result<T, String> {
    // SAFETY: promised by the caller.
    let found: Result<Symbol<T>, _> = unsafe { library.get(name.as_bytes()) };
    found.map(|symbol| *symbol).map_err(|error| error.to_string())
}
