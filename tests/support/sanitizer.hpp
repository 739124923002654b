#pragma once

// Whether this is a build with the address or the thread sanitizer: they have the allocator in
// hand, need all of the address space, and hold memory of their own.
#define FLYBALL_SANITIZED 0
#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
#undef FLYBALL_SANITIZED
#define FLYBALL_SANITIZED 1
#elif defined(__has_feature)
#if __has_feature(address_sanitizer) || __has_feature(thread_sanitizer)
#undef FLYBALL_SANITIZED
#define FLYBALL_SANITIZED 1
#endif
#endif
