#pragma once

#include <flyball/study/design.hpp>

namespace flyball::study {

/// A design's gains as other tools know them, for `exports::paste_constants`. (The loop itself is
/// `exports::generate_loop` of `controller_of`.)
[[nodiscard]] exports::MechanismConstants constants_of(const DesignResult& design);

}  // namespace flyball::study
