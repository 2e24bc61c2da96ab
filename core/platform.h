/* platform - what a build is for */
#pragma once

/* A sanitizer has handlers of its own, needs more memory than any limit allows, and starts processes to report. */
#if defined __SANITIZE_ADDRESS__ || defined __SANITIZE_THREAD__
#define QUERN_SANITIZED 1
#elif defined __has_feature
#if __has_feature(address_sanitizer) || __has_feature(thread_sanitizer) || __has_feature(memory_sanitizer)
#define QUERN_SANITIZED 1
#endif
#endif
