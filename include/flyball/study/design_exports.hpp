#pragma once

#include <string_view>

#include <flyball/study/design.hpp>

namespace flyball::study {

/// A design's gains as other tools know them, for `exports::paste_constants`. (The loop itself is
/// `exports::generate_header` of `controller_of`.)
/// @param kA_reason  Why kA is not determined, if it is not and that is known.
[[nodiscard]] exports::MechanismConstants constants_of(const DesignResult& design,
                                                       std::string_view kA_reason = {});

}  // namespace flyball::study
