#pragma once

#include <tl/expected.hpp>

#include <flyball/core/error.hpp>

namespace flyball {

/// A result, or the reason why there is none. What every design-time function returns.
template <class T>
using Expected = tl::expected<T, Error>;

}  // namespace flyball
