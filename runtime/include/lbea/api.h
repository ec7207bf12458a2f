/* api.h - what the shared library shows, LBEA_API; everything else in it is hidden. */
#ifndef LBEA_API_H
#define LBEA_API_H

#if defined(__GNUC__)
#define LBEA_API __attribute__((visibility("default")))
#define LBEA_HIDDEN __attribute__((visibility("hidden"))) /* for the insides of a class that is shown */
#else
#define LBEA_API
#define LBEA_HIDDEN
#endif

#endif
