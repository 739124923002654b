#pragma once

// What nearly every source includes; nothing of the project, so that it seldom changes.

#include <algorithm>
#include <cmath>
#include <complex>
#include <limits>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include <Eigen/Core>
#include <tl/expected.hpp>
#ifndef FLYBALL_WITHOUT_FMT
#include <fmt/core.h>
#endif
