/* api.h - LBEA_API marks what the shared library exports; everything else is hidden. */
#ifndef LBEA_API_H
#define LBEA_API_H

#if defined(_WIN32) /* lbea.def lists the exports */
#define LBEA_API
#define LBEA_HIDDEN
#elif defined(__GNUC__)
#define LBEA_API __attribute__((visibility("default")))
#define LBEA_HIDDEN __attribute__((visibility("hidden"))) /* for internals of an exported class */
#else
#define LBEA_API
#define LBEA_HIDDEN
#endif

#endif
