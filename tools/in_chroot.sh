#!/bin/sh
# in_chroot.sh ROOT PROJECT PROGRAM [ARGUMENT…]: run PROGRAM in the system under ROOT, as root, in the current folder.
# /dev, /proc, /tmp, $TMPDIR, PROJECT and the current folder are the same inside. The mounts are seen by nobody else, and
# they and every process started here end with PROGRAM, or when this script is killed.
set -eu

if [ "${1:-}" != --inside ]; then
    exec unshare --mount --pid --fork --kill-child --propagation private "$0" --inside "$@"
fi
shift
root=$1 project=$2
shift 2

mount --rbind /dev "$root/dev"
mount -t proc proc "$root/proc"
for folder in /tmp "${TMPDIR:-/tmp}" "$project" "$PWD"; do
    case $folder in
    / | /usr | /usr/* | /bin | /etc | /lib | /lib64 | /sbin | /var)
        echo "in_chroot.sh: cannot be used from $folder: it would hide the other system's own" >&2
        exit 1 ;;
    /tmp/*) continue ;;
    esac
    mkdir -p "$root$folder"
    mount --rbind "$folder" "$root$folder"
done

# Nothing of this system's libraries or Python may reach into the other one. PROGRAM is not to be process 1 of its
# namespace, as it would be by exec: such a process gets no signal that it has no handler for (xvfb-run waits for one).
status=0
chroot "$root" /usr/bin/env --chdir="$PWD" -u LD_LIBRARY_PATH -u LD_PRELOAD -u PYTHONPATH -u PYTHONHOME \
    -u XDG_RUNTIME_DIR -u XDG_CONFIG_HOME -u XDG_CACHE_HOME -u WAYLAND_DISPLAY \
    HOME=/root PATH=/usr/sbin:/usr/bin:/sbin:/bin LC_ALL=C.UTF-8 "$@" || status=$?
exit "$status"
