/* A stand-in for the driver of a GPU: its memory is that of the processor, its kernels run one thread after the other.
   It has the calls that cuda-core and cuda-bindings make for engine/cuda/gpu.py, and no others. */
#define _GNU_SOURCE
#include <dlfcn.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
typedef unsigned long long address;
typedef struct { unsigned x, y, z; } place;
typedef struct { void *library; void (*call)(void **); } kernel;
typedef struct { place grid, block; unsigned shared; void *stream, *attributes; unsigned count; } launch;
enum { MAJOR = 75, MINOR = 76, NO_MEMORY = 2, NO_DEVICE = 101, NOT_FOUND = 500 };
static void *current;

int cuInit(unsigned flags) { return 0; }
int cuDriverGetVersion(int *version) { *version = 13000; return 0; }
int cuDeviceGetCount(int *count) { *count = 1; return 0; }
int cuDeviceGet(int *device, int number) { *device = number; return number ? NO_DEVICE : 0; }
int cuDeviceGetName(char *name, int size, int device) { snprintf(name, size, "stand-in"); return 0; }
int cuDeviceGetAttribute(int *value, int which, int device) { *value = which == MAJOR ? 9 : which == MINOR ? 0 : 1; return 0; }
int cuDevicePrimaryCtxRetain(void **context, int device) { *context = (void *)1; return 0; }
int cuDevicePrimaryCtxRelease_v2(int device) { return 0; }
int cuCtxSetCurrent(void *context) { current = context; return 0; }
int cuCtxGetCurrent(void **context) { *context = current; return 0; }
int cuStreamSynchronize(void *stream) { return 0; }
int cuStreamIsCapturing(void *stream, int *state) { *state = 0; return 0; }
int cuDeviceGetMemPool(void **pool, int device) { *pool = (void *)1; return 0; }
int cuMemPoolGetAttribute(void *pool, int which, void *value) { memset(value, 0, 8); return 0; }
int cuMemPoolSetAttribute(void *pool, int which, void *value) { return 0; }
int cuMemAllocFromPoolAsync(address *to, size_t size, void *pool, void *stream) { *to = (address)malloc(size); return *to ? 0 : NO_MEMORY; }
int cuMemFreeAsync(address from, void *stream) { free((void *)from); return 0; }
int cuMemcpyHtoD_v2(address to, const void *from, size_t size) { memcpy((void *)to, from, size); return 0; }
int cuMemcpyDtoH_v2(void *to, address from, size_t size) { memcpy(to, (void *)from, size); return 0; }
int cuMemcpyDtoD_v2(address to, address from, size_t size) { memcpy((void *)to, (void *)from, size); return 0; }
int cuGetErrorName(int error, const char **name) { *name = "error of the stand-in"; return 0; }
int cuGetErrorString(int error, const char **text) { *text = "error of the stand-in"; return 0; }

/* The code of a library is the path of one of the processor; a kernel has a function that takes pointers to arguments. */
int cuLibraryLoadData(void **library, const void *code, void *a, void *b, unsigned c, void *d, void *e, unsigned f) {
  *library = dlopen(code, RTLD_NOW);
  return *library ? 0 : NOT_FOUND;
}
int cuLibraryUnload(void *library) { return 0; }
int cuLibraryGetKernel(kernel **made, void *library, const char *name) {
  char text[64];
  snprintf(text, sizeof text, "call_%s", name);
  *made = malloc(sizeof **made);
  (*made)->library = library;
  (*made)->call = (void (*)(void **))dlsym(library, text);
  return (*made)->call ? 0 : NOT_FOUND;
}
int cuLibraryGetGlobal(address *where, size_t *size, void *library, const char *name) {
  *where = (address)dlsym(library, name);
  *size = *(unsigned long *)dlsym(library, "size_of_K");
  return *where ? 0 : NOT_FOUND;
}
int cuLaunchKernelEx(const launch *how, kernel *of, void **arguments, void **extra) {
  place *thread = dlsym(of->library, "threadIdx"), *block = dlsym(of->library, "blockIdx");
  *(place *)dlsym(of->library, "blockDim") = how->block;
  for (block->x = 0; block->x < how->grid.x; block->x++)
    for (thread->x = 0; thread->x < how->block.x; thread->x++) of->call(arguments);
  return 0;
}
int cuGetProcAddress_v2(const char *name, void **found, int version, unsigned long long flags, int *status) {
  static const char *const endings[] = {"_v3", "_v2", ""};
  char text[96];
  *found = NULL;
  for (int i = 0; i < 3 && !*found; i++) {
    snprintf(text, sizeof text, "%s%s", name, endings[i]);
    *found = dlsym(RTLD_DEFAULT, text);
  }
  if (status) *status = !*found;
  return 0;
}
