#pragma once

#include <functional>
#include <source_location>

#include <flyball/core/random.hpp>

/// RapidCheck behind functions that are compiled once: it takes a second or more for each property,
/// and a part of one for each assertion.
namespace flyball::test {

/// Whether a law holds for random numbers of many seeds; if not, the test fails and says the seed.
[[nodiscard]] bool holds_for_random(const char* name, const std::function<void(Random&)>& law);

/// Within a law: what has to be true.
void require(bool is_true, std::source_location at = std::source_location::current());

}  // namespace flyball::test
