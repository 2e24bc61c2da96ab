/* SPDX-License-Identifier: MIT */
/* platform - what differs between operating systems, processors and builds */
#pragma once
#include <stddef.h>
#include <stdint.h>

/* A sanitizer has handlers of its own, needs more memory than any limit allows, and starts processes to report. */
#if defined __SANITIZE_ADDRESS__ || defined __SANITIZE_THREAD__
#define QUERN_SANITIZED 1
#elif defined __has_feature
#if __has_feature(address_sanitizer) || __has_feature(thread_sanitizer) || __has_feature(memory_sanitizer)
#define QUERN_SANITIZED 1
#endif
#endif

/* Processors that this process may use: those it is bound to, and no more than a container's quota pays for. At least 1. */
uint32_t quern_platform_processors(void);
/* Tells the processor that this thread waits in a loop. */
void quern_platform_pause(void);
/* A clock that is quick to read: of even ticks, of no length that anybody knows. */
uint64_t quern_platform_ticks(void);
/* The file of the running program; free(). NULL: it cannot be known. */
char *quern_platform_program(void);
/* Memory of that many bytes, more than none, that begins with a line of the cache; free(). Where the system has large pages, a large
 * block lies in them: it would otherwise need more entries than a processor keeps of a page's place. NULL: there is none. */
void *quern_platform_memory(size_t bytes);
/* What lies in these bytes is not needed any more, and may be anything when it is read: whole pages go back to the system. */
void quern_platform_forget(void *memory, size_t bytes);
/* Before memory is taken: that blocks of a megabyte and more go back to the system when they are freed, and of smaller ones what is over
 * eight megabytes. Left to itself, malloc would keep the size of all that has been freed so far, and what fills a scene would stay for as
 * long as it runs; or it would give back each of a file's buffers, whose pages the system clears anew for the next. */
void quern_platform_begin(void);
/* When much has been freed for long: what is kept for the next block goes back to the system. */
void quern_platform_trim(void);
/* Bytes that were resident at most since the program began: what had started it does not count. 0: it cannot be known. */
int64_t quern_platform_peak_memory(void);
