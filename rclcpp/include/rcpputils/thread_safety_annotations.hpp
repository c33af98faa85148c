// Annotations of locks for Clang's analysis. They mean nothing here: it needs a standard library
// whose mutexes are annotated, and libstdc++'s are not.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#define RCPPUTILS_TSA_CAPABILITY(x)
#define RCPPUTILS_TSA_SCOPED_CAPABILITY
#define RCPPUTILS_TSA_GUARDED_BY(x)
#define RCPPUTILS_TSA_PT_GUARDED_BY(x)
#define RCPPUTILS_TSA_ACQUIRED_BEFORE(...)
#define RCPPUTILS_TSA_ACQUIRED_AFTER(...)
#define RCPPUTILS_TSA_REQUIRES(...)
#define RCPPUTILS_TSA_REQUIRES_SHARED(...)
#define RCPPUTILS_TSA_ACQUIRE(...)
#define RCPPUTILS_TSA_ACQUIRE_SHARED(...)
#define RCPPUTILS_TSA_RELEASE(...)
#define RCPPUTILS_TSA_RELEASE_SHARED(...)
#define RCPPUTILS_TSA_TRY_ACQUIRE(...)
#define RCPPUTILS_TSA_TRY_ACQUIRE_SHARED(...)
#define RCPPUTILS_TSA_EXCLUDES(...)
#define RCPPUTILS_TSA_ASSERT_CAPABILITY(x)
#define RCPPUTILS_TSA_ASSERT_SHARED_CAPABILITY(x)
#define RCPPUTILS_TSA_RETURN_CAPABILITY(x)
#define RCPPUTILS_TSA_NO_THREAD_SAFETY_ANALYSIS
