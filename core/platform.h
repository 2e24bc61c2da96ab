/* platform - what differs between operating systems and processors */
#pragma once
#include <stdint.h>

/* Processors that this process may use: those it is bound to, and no more than a container's quota pays for. At least 1. */
uint32_t quern_platform_processors(void);
/* Tells the processor that this thread waits in a loop. */
void quern_platform_pause(void);
