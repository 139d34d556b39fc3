/* What marks an entry point of the library; all else stays inside. */
#ifndef SEATRIAL_ENTRY_H
#define SEATRIAL_ENTRY_H

#if defined _WIN32
#define ENTRY __declspec(dllexport)
#elif defined __GNUC__
#define ENTRY __attribute__((visibility("default")))
#else
#define ENTRY
#endif

#endif
