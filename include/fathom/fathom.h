// SPDX-License-Identifier: MIT
#ifndef FATHOM_FATHOM_H
#define FATHOM_FATHOM_H

// Fathom: exact distance fields of voxel grids on any Vulkan 1.3 GPU and on plain CPUs.
//
// Conventions that hold for every declaration of this header:
// - Element order is x fastest, then y, then z: voxel (x, y, z) of a grid of shape (X, Y, Z) is element x + X * (y + Y * z),
//   which is a C-ordered NumPy array of shape (Z, Y, X), unchanged.
// - A descriptor (`*_desc`) that is all zero asks for the defaults; a NULL descriptor does too.
// - A call that can fail returns `fm_result`; when it fails it has changed nothing, and `fm_last_error` says why.
// - `*_destroy(NULL)` does nothing.
// - Pointers to outputs must not be NULL unless the comment says that NULL is allowed.

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

#define FM_VERSION_MAJOR 0
#define FM_VERSION_MINOR 1
#define FM_VERSION_PATCH 0

#if defined(_WIN32) && defined(FM_SHARED)
#ifdef FM_BUILDING
#define FM_API __declspec(dllexport)
#else
#define FM_API __declspec(dllimport)
#endif
#elif defined(__GNUC__)
#define FM_API __attribute__((visibility("default")))
#else
#define FM_API
#endif

// The index that marks "no solid voxel": the grid has none, or the nearest one lies beyond `max_distance`, or the nearest
// solid place lies outside the grid (`FM_OUTSIDE_SOLID`). 32-bit and 64-bit index volumes use the value of their width.
#define FM_NO_INDEX_32 UINT32_MAX
#define FM_NO_INDEX_64 UINT64_MAX

// ---------------------------------------------------------------------------------------------------------------------------
// Results, errors, memory and messages
// ---------------------------------------------------------------------------------------------------------------------------

typedef enum fm_result {
    FM_OK = 0,
    FM_ERROR_INVALID_ARGUMENT,    // an argument is outside what its comment accepts
    FM_ERROR_RANGE,               // the chosen type cannot hold the answer, or a size overflows
    FM_ERROR_OUT_OF_HOST_MEMORY,  // the allocator returned NULL
    FM_ERROR_OUT_OF_DEVICE_MEMORY,
    FM_ERROR_NO_DEVICE,    // no device fits the request; the message lists why each one was passed over
    FM_ERROR_DEVICE_LOST,  // the one error after which the context is of no further use
    FM_ERROR_UNSUPPORTED,  // valid, but not possible on this backend or build
    FM_ERROR_IO,           // the operating system refused; the message has its reason
    FM_ERROR_FORMAT,       // a file is not what it claims to be
    FM_ERROR_INTERNAL,     // a driver call failed in a way that no argument explains
} fm_result;

// Name of a result, e.g. "FM_ERROR_RANGE". Never NULL. Thread-safe.
FM_API const char *fm_result_name(fm_result result);

// Message of the last call that failed on the calling thread, naming the argument, the value and what would be accepted.
// Never NULL; empty when none has failed. Valid until the next failing call on this thread. Thread-safe.
FM_API const char *fm_last_error(void);

// Version of the library that is linked, as "MAJOR.MINOR.PATCH". Thread-safe.
FM_API const char *fm_version(void);

// Host memory hooks. `alloc` returns `size` bytes aligned to `alignment` (a power of two, at most 4096), or NULL, which Fathom
// reports as FM_ERROR_OUT_OF_HOST_MEMORY. `free` gets the size that was asked for; it is never called with NULL.
// Both may be called from any thread that Fathom runs work on. Device memory does not pass through here.
typedef struct fm_allocator {
    void *(*alloc)(void *user, size_t size, size_t alignment);
    void (*free)(void *user, void *memory, size_t size);
    void *user;
} fm_allocator;

typedef enum fm_log_level { FM_LOG_DEBUG = 0, FM_LOG_INFO, FM_LOG_WARNING, FM_LOG_ERROR } fm_log_level;

// Receives one message, without a newline. May be called from any thread; must not call back into Fathom.
typedef void (*fm_log_fn)(void *user, fm_log_level level, const char *message);

// ---------------------------------------------------------------------------------------------------------------------------
// Devices and contexts
// ---------------------------------------------------------------------------------------------------------------------------

typedef enum fm_backend {
    FM_BACKEND_AUTO = 0,  // a real GPU if one is usable, else the CPU; never a software Vulkan driver
    FM_BACKEND_CPU,
    FM_BACKEND_VULKAN,  // any usable Vulkan device, real GPUs first, software drivers last
} fm_backend;

typedef enum fm_device_kind {
    FM_DEVICE_DISCRETE_GPU = 0,
    FM_DEVICE_INTEGRATED_GPU,
    FM_DEVICE_VIRTUAL_GPU,
    FM_DEVICE_OTHER,
    FM_DEVICE_SOFTWARE,  // a Vulkan driver that runs on the CPU
    FM_DEVICE_HOST,      // the native CPU backend
} fm_device_kind;

// One device and the limits of it that Fathom heeds. Sizes are in bytes.
typedef struct fm_device_info {
    char name[256];
    char driver[256];  // driver name and version as text; for FM_DEVICE_HOST the instruction set chosen
    char reason[256];  // why the device is not usable; empty when it is
    fm_device_kind kind;
    bool usable;
    uint32_t index;           // what `fm_context_desc.device` takes; Vulkan devices only
    uint32_t api_version;     // Vulkan's encoding (major << 22 | minor << 12 | patch); 0 for FM_DEVICE_HOST
    uint32_t threads;         // logical processors for FM_DEVICE_HOST, else 0
    uint32_t subgroup_size;   // lanes of a subgroup, or SIMD lanes of 32 bits for FM_DEVICE_HOST
    uint32_t max_workgroup;   // invocations of one workgroup
    uint64_t memory;          // device-local heap, or physical memory for FM_DEVICE_HOST
    uint64_t shared_memory;   // of one workgroup
    uint64_t max_allocation;  // largest single buffer; whether that much memory is free is another matter
    uint64_t max_descriptor_range;
    double timestamp_period_ns;
    bool host_visible_memory;  // the whole device-local heap can be mapped (resizable BAR or unified memory)
    bool float16;
} fm_device_info;

// Lists the devices of this machine: the native CPU backend first, then every Vulkan device in the driver's order, usable or not.
// `count` holds the capacity of `devices` on entry and the number written on return; with `devices` NULL only the number there
// is gets written. A machine with no Vulkan loader or driver is no error: it has one device. `vulkan_note` (NULL allowed) gets
// an empty string or one line on why no Vulkan device is listed, `note_size` bytes at most.
// Thread-safe.
FM_API fm_result fm_enumerate_devices(uint32_t *count, fm_device_info *devices, char *vulkan_note, size_t note_size);

// A caller's Vulkan objects, to be used instead of new ones. The handles are those of <vulkan/vulkan.h>, passed as pointers
// so that this header needs no Vulkan. Fathom never destroys them; they must outlive the context.
// The device must be of Vulkan 1.3 and have been created with the features bufferDeviceAddress, timelineSemaphore,
// synchronization2, storageBuffer8BitAccess, storageBuffer16BitAccess, shaderInt8, shaderInt16, shaderInt64, maintenance4 and
// hostQueryReset.
// `queue` must support compute and must be externally synchronised with the calls made on the context.
typedef struct fm_vulkan_device {
    void *get_instance_proc_addr;  // PFN_vkGetInstanceProcAddr
    void *instance;                // VkInstance
    void *physical_device;         // VkPhysicalDevice
    void *device;                  // VkDevice
    void *queue;                   // VkQueue
    uint32_t queue_family;
    bool has_float16;             // the device was created with shaderFloat16
    bool has_external_memory_fd;  // the device was created with VK_KHR_external_memory_fd
} fm_vulkan_device;

typedef struct fm_context_desc {
    fm_backend backend;
    const char *device;             // Vulkan device: an index ("1") or a part of its name, case ignored; NULL: the best one
    uint32_t threads;               // worker threads of the CPU backend; 0: one a logical processor
    bool validation;                // load the Khronos validation layer; its messages go to `log` as warnings and
                                    // errors. Of no effect on the CPU backend and on adopted Vulkan objects
    const fm_allocator *allocator;  // NULL: the C library's; copied
    fm_log_fn log;                  // NULL: nobody is told
    void *log_user;
    const fm_vulkan_device *vulkan;  // NULL: Fathom makes its own; else FM_BACKEND_CPU is refused; copied
} fm_context_desc;

// A context owns a backend, its threads or queue, its pipelines and its scratch memory.
// One context may be used by one thread at a time; contexts are independent of each other.
typedef struct fm_context fm_context;

// Creates a context. `desc` may be NULL.
// With FM_BACKEND_AUTO and neither `device` nor `vulkan`, a machine without a usable GPU, a build without Vulkan and a driver that
// fails are no errors: the context then runs on the CPU, and `log` is told why. Else these are FM_ERROR_NO_DEVICE (also: `device`
// names none, the device lacks a feature, or `validation` finds no layer), FM_ERROR_UNSUPPORTED and FM_ERROR_INTERNAL.
// Errors besides: FM_ERROR_INVALID_ARGUMENT for a `backend` that is no fm_backend, more than 1,024 threads, an allocator that lacks
// a function, FM_BACKEND_CPU with `device` or `vulkan`, `device` with `vulkan`, a missing handle in `vulkan`, or a queue family
// there that does not compute; FM_ERROR_OUT_OF_HOST_MEMORY, also when a thread cannot be started; FM_ERROR_OUT_OF_DEVICE_MEMORY.
// Thread-safe.
FM_API fm_result fm_context_create(const fm_context_desc *desc, fm_context **context);

// Waits for the work in flight, then frees everything. Volumes made from the context must be destroyed before.
FM_API void fm_context_destroy(fm_context *context);

// The backend in use: FM_BACKEND_CPU or FM_BACKEND_VULKAN, never AUTO.
FM_API fm_backend fm_context_backend(const fm_context *context);

// What the context runs on.
FM_API void fm_context_device(const fm_context *context, fm_device_info *info);

// The Vulkan objects in use, own or adopted, so that a program can record its own work on them.
// `timeline` (NULL allowed) gets the VkSemaphore whose value reaches a ticket when that ticket's work is complete.
// Errors: FM_ERROR_UNSUPPORTED on the CPU backend.
FM_API fm_result fm_context_vulkan(const fm_context *context, fm_vulkan_device *device, void **timeline);

// Number of validation messages of severity warning or error since the context was made.
FM_API uint64_t fm_context_validation_messages(const fm_context *context);

// A point in the context's stream of work. Tickets rise; work of a lower ticket is complete when a higher one is.
// The CPU backend works at once: its tickets are complete when they are given out.
typedef uint64_t fm_ticket;

// Blocks until `ticket` is complete. 0 is always complete. Errors: FM_ERROR_INVALID_ARGUMENT for a ticket of Vulkan that was not
// given out yet, FM_ERROR_DEVICE_LOST.
FM_API fm_result fm_wait(fm_context *context, fm_ticket ticket);

// Whether `ticket` is complete, without blocking. Errors: as fm_wait.
FM_API fm_result fm_poll(fm_context *context, fm_ticket ticket, bool *complete);

// One pass of the last operation that has completed.
typedef struct fm_pass {
    const char *name;     // static storage
    double milliseconds;  // GPU timestamps, or the monotonic clock on the CPU backend
    uint64_t bytes;       // fewest bytes that the pass must move through memory
} fm_pass;

// The passes of the newest operation (a transform or a copy), in the order in which they ran. Waits for it.
// `count` is as for fm_enumerate_devices.
FM_API fm_result fm_context_passes(fm_context *context, uint32_t *count, fm_pass *passes);

// The same of the operation that is complete at `ticket`, for programs that keep several in flight: waits for that one alone, and
// fm_poll says beforehand whether it must. Known are the newest eight submissions. An operation is one; so are uploads and
// downloads, and each iteration under FM_CONVERGE_HOST (world.h). An older ticket, and 0, has no passes: `count` gets 0. The CPU
// backend lists those of its newest operation, whatever the ticket. Errors: FM_ERROR_INVALID_ARGUMENT for NULL (but for `passes`)
// and a ticket that was not given out; FM_ERROR_DEVICE_LOST; FM_ERROR_INTERNAL when the driver fails.
FM_API fm_result fm_ticket_passes(fm_context *context, fm_ticket ticket, uint32_t *count, fm_pass *passes);

// Memory held by the context and what was made from it, by purpose.
typedef struct fm_memory {
    const char *purpose;  // "volumes", "scratch", "voxels", "field", ...; on devices also "staging", ...; static storage
    bool device;          // device memory, else host memory
    uint64_t bytes;       // now
    uint64_t peak;        // highest since the context was made
} fm_memory;

// `count` is as for fm_enumerate_devices.
FM_API fm_result fm_context_memory(fm_context *context, uint32_t *count, fm_memory *memory);

// Frees the scratch and staging memory that is kept between calls. Waits for the work in flight.
FM_API fm_result fm_context_trim(fm_context *context);

// ---------------------------------------------------------------------------------------------------------------------------
// Element types, arrays and volumes
// ---------------------------------------------------------------------------------------------------------------------------

typedef enum fm_type {
    FM_TYPE_U8 = 0,
    FM_TYPE_U16,
    FM_TYPE_U32,
    FM_TYPE_F32,
    // One bit a voxel. A row of X voxels takes ceil(X / 32) 32-bit words in the machine's byte order; voxel x is bit x % 32 of word
    // x / 32; the bits past X are ignored on input and zero on output. Rows follow each other as in the other types.
    FM_TYPE_BITS,
    FM_TYPE_I8,
    FM_TYPE_I16,
    FM_TYPE_I32,
    FM_TYPE_U64,
    FM_TYPE_I64,
    FM_TYPE_F64,
} fm_type;

// Name as NumPy writes it ("uint8", "float32"), or "bits". Never NULL. Thread-safe.
FM_API const char *fm_type_name(fm_type type);

// Bytes of one element; 0 for FM_TYPE_BITS. Thread-safe.
FM_API size_t fm_type_size(fm_type type);

// Voxels along each axis. Every axis is 1 to 2^31 - 1.
typedef struct fm_shape {
    uint32_t x, y, z;
} fm_shape;

// Bytes of a dense array of this shape and type. Errors: FM_ERROR_INVALID_ARGUMENT for an axis of 0 or above 2^31 - 1,
// FM_ERROR_RANGE when the size does not fit in 63 bits. Thread-safe.
FM_API fm_result fm_array_bytes(fm_shape shape, fm_type type, uint64_t *bytes);

// The caller's dense array in host memory, aligned to its element (to 4 bytes for FM_TYPE_BITS).
typedef struct fm_array {
    void *data;
    fm_type type;
    fm_shape shape;
} fm_array;

typedef enum fm_storage {
    FM_STORAGE_DEFAULT = 0,  // where the context computes
    FM_STORAGE_HOST,         // host memory; fm_volume_data gives the address
    FM_STORAGE_DEVICE,       // device memory; FM_ERROR_UNSUPPORTED on the CPU backend
} fm_storage;

typedef struct fm_volume_desc {
    fm_shape shape;
    fm_type type;
    fm_storage storage;
    double spacing[3];  // edge of a voxel along x, y, z in world units; all 0: 1, 1, 1; else finite and above 0
    double origin[3];   // world position of the centre of voxel (0, 0, 0); finite
    bool exportable;    // device memory that fm_volume_export_fd can give out; Linux
} fm_volume_desc;

// A typed dense grid. Same thread rule as its context; a volume made without a context may be used by one thread at a time.
typedef struct fm_volume fm_volume;

// Creates a volume; its contents are undefined. `context` may be NULL for host storage: the C library's allocator then serves.
// Errors: FM_ERROR_INVALID_ARGUMENT for `desc` NULL, a shape or type that fm_array_bytes refuses, a `storage` that is no
// fm_storage, or a spacing or origin outside its rules; FM_ERROR_RANGE when the size does not fit in 63 bits; FM_ERROR_UNSUPPORTED
// for device storage without a context on Vulkan, and for `exportable` in host memory or on a device without
// VK_KHR_external_memory_fd; FM_ERROR_OUT_OF_HOST_MEMORY; FM_ERROR_OUT_OF_DEVICE_MEMORY, which says how much was needed and how
// much there is; FM_ERROR_DEVICE_LOST; FM_ERROR_INTERNAL when the driver fails.
FM_API fm_result fm_volume_create(fm_context *context, const fm_volume_desc *desc, fm_volume **volume);

// Waits for work in flight that may use it. NULL is ignored.
FM_API void fm_volume_destroy(fm_volume *volume);

// What the volume was made with; storage is HOST or DEVICE, never DEFAULT.
FM_API void fm_volume_info(const fm_volume *volume, fm_volume_desc *desc);

// Replaces spacing and origin, by the rules of fm_volume_desc. Either may be NULL: that one stays.
FM_API fm_result fm_volume_place(fm_volume *volume, const double spacing[3], const double origin[3]);

// Address of the elements of a host volume; NULL for device storage. Valid until the volume is destroyed.
FM_API void *fm_volume_data(fm_volume *volume);

// 256 RGBA colours (1,024 bytes) that the element values stand for, kept with the volume; NULL when it has none.
FM_API const uint8_t *fm_volume_palette(const fm_volume *volume);
// Copies 1,024 bytes; NULL takes the palette away.
FM_API fm_result fm_volume_set_palette(fm_volume *volume, const uint8_t *rgba);

// Copies all elements from or to host memory of fm_array_bytes bytes; returns when done.
FM_API fm_result fm_volume_upload(fm_volume *volume, const void *source);
FM_API fm_result fm_volume_download(fm_volume *volume, void *target);

// Copies one volume's elements over those of another of the same shape and type, either storage, not the same volume; not its place
// or palette. A copy within the device is one pass named "copy", asynchronous, complete at `ticket` (NULL: the call waits). Every
// other copy is done on return, with the ticket 0.
// Errors: FM_ERROR_INVALID_ARGUMENT for volumes that are NULL, the same, of different shape or type, or in the device memory of
// another context; FM_ERROR_OUT_OF_HOST_MEMORY and FM_ERROR_OUT_OF_DEVICE_MEMORY where the copy needs a pipeline or staging
// memory that cannot be had; FM_ERROR_DEVICE_LOST; FM_ERROR_INTERNAL when the driver fails.
FM_API fm_result fm_volume_copy(fm_context *context, const fm_volume *source, fm_volume *target, fm_ticket *ticket);

// The buffer behind a device volume, for programs that read the field where it lies.
typedef struct fm_volume_buffer {
    void *buffer;             // VkBuffer (a pointer on 64-bit machines), usage: storage, transfer and device address
    uint64_t offset;          // of the first element, in bytes
    uint64_t size;            // in bytes
    uint64_t device_address;  // of the first element
    void *memory;             // VkDeviceMemory
    uint64_t memory_size;     // of the whole VkDeviceMemory, as CUDA's import wants it
} fm_volume_buffer;

// Errors: FM_ERROR_UNSUPPORTED for host storage.
FM_API fm_result fm_volume_vulkan(const fm_volume *volume, fm_volume_buffer *buffer);

// A new file descriptor for the memory of a volume made `exportable` (VK_EXTERNAL_MEMORY_HANDLE_TYPE_OPAQUE_FD_BIT); the
// caller, or the API that imports it, closes it. `buffer.offset` and `memory_size` of fm_volume_vulkan say where the elements lie.
// Errors: FM_ERROR_UNSUPPORTED when the volume is not exportable.
FM_API fm_result fm_volume_export_fd(const fm_volume *volume, int *fd);

// ---------------------------------------------------------------------------------------------------------------------------
// Distance transforms
// ---------------------------------------------------------------------------------------------------------------------------

typedef enum fm_metric {
    FM_METRIC_L2 = 0,  // Euclidean
    FM_METRIC_L1,      // Manhattan
    FM_METRIC_LINF,    // chessboard
} fm_metric;

typedef enum fm_algorithm {
    FM_ALGORITHM_AUTO = 0,     // the fastest exact one
    FM_ALGORITHM_SEPARABLE,    // one exact pass an axis
    FM_ALGORITHM_BRUTE_FORCE,  // every solid voxel against every voxel: the oracle; quadratic time
} fm_algorithm;

typedef enum fm_select {
    FM_SELECT_NONZERO = 0,  // a voxel is solid when its value is not 0
    FM_SELECT_THRESHOLD,    // ... when its value >= `threshold`, compared exactly, not in the element's type
    FM_SELECT_LABEL,        // ... when its value == `label`; integer types and bits only
} fm_select;

typedef enum fm_outside {
    FM_OUTSIDE_EMPTY = 0,  // what lies outside the grid is empty
    FM_OUTSIDE_SOLID,      // ... is solid: no distance exceeds the way out of the grid
} fm_outside;

// What to compute. Distances are from voxel centre to voxel centre, in voxels, or in world units when `spacing` is given.
typedef struct fm_transform_desc {
    fm_metric metric;
    fm_algorithm algorithm;
    fm_select select;
    fm_outside outside;
    double threshold;
    int64_t label;

    // Negative inside: a solid voxel gets minus the distance to the nearest empty voxel (what lies outside the grid counts as
    // `outside` says). Needs a signed distance type.
    bool is_signed;

    // L2 only: the squared distance, minus the squared distance inside when signed.
    bool squared;

    // Integer distance types: a distance above the largest value of the type becomes that value. Without it, a type that cannot
    // hold the greatest distance that the shape allows is refused with FM_ERROR_RANGE.
    bool saturate;

    // Edge of a voxel along x, y, z; all 0: voxel units. Needs FM_TYPE_F32 distances, which are then in world units.
    double spacing[3];

    // Distances above this become this (also where there is no solid voxel), in the units of the result before squaring.
    // 0: no limit. Must be a whole number for integer distance types.
    double max_distance;
} fm_transform_desc;

// Computes the distance field of `solid`.
//
// `distance` (NULL: not wanted) may be:
//   unsigned U8, U16, U32, F32; signed I8, I16, I32, F32. `squared` takes U32, I32 and F32. L2 without `squared` needs F32, or an
//   integer type, which then gets the distance rounded down.
// A solid voxel has distance 0 in an unsigned field. Where the grid has no solid voxel (and, in a signed field, inside where it has
// no empty one) the distance is the largest value of the type (-largest inside), +-infinity in F32.
// `indices` (NULL: not wanted), U32 or U64, gets the element index x + X * (y + Y * z) of the nearest solid voxel: of the lowest
// index among equally near ones. U32 needs a grid of fewer than 2^32 - 1 voxels. For signed fields too it is the nearest *solid*
// voxel. At least one of the two is wanted. All shapes are equal; no two arrays overlap.
//
// Integer metrics (all three on unit voxels, squared L2 included) are exact and equal bit for bit on every backend, F32 L2 being
// the correctly rounded root of the exact square when that is below 2^32. With a `spacing` whose axes differ the sums are in
// 32-bit floats, each rounded: error within 4 units in the last place.
//
// Errors: FM_ERROR_INVALID_ARGUMENT (also for NaN in a floating point grid under FM_SELECT_THRESHOLD or FM_SELECT_NONZERO: the
// message names the first such voxel), FM_ERROR_RANGE, FM_ERROR_OUT_OF_HOST_MEMORY, FM_ERROR_OUT_OF_DEVICE_MEMORY. On an error
// outputs are untouched, unless the device was lost meanwhile. Thread safety: as the context. `fm_transform_host` returns when the
// arrays are written.
//
// Source: one exact pass an axis, and on the CPU the search outwards along a column that ends where no row farther away can win:
// Saito and Toriwaki 1994, "New algorithms for Euclidean distance transformation of an n-dimensional digitized picture", here past
// blocks of rows by their minima. L1 by sweeps along the columns: Rosenfeld and Pfaltz 1968, "Distance functions on digital
// pictures"; on Vulkan these are scans. There the other columns rest on the row of the nearest site never decreasing (total
// monotonicity: Aggarwal et al. 1987, "Geometric applications of a matrix-searching algorithm"), or on the lower envelope of
// parabolas (Felzenszwalb and Huttenlocher 2012, "Distance transforms of sampled functions").
FM_API fm_result fm_transform_host(fm_context *context, const fm_transform_desc *desc, const fm_array *solid,
                                   const fm_array *distance, const fm_array *indices);

// The same on volumes that live where the context computes: asynchronous on Vulkan, complete at `ticket` (NULL: the call waits).
// The volumes must not be written, read by the host or destroyed before that. Device input types: U8, U16, U32, F32, BITS; a NaN
// counts as empty here. Where `desc->spacing` is all 0 distances are in voxels, whatever the volume's own spacing; a distance
// volume takes over the spacing and origin of `solid`.
FM_API fm_result fm_transform(fm_context *context, const fm_transform_desc *desc, const fm_volume *solid, fm_volume *distance,
                              fm_volume *indices, fm_ticket *ticket);

#ifdef __cplusplus
}
#endif

#endif
