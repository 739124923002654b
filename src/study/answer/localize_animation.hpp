#pragma once

#include <string>
#include <vector>

#include <flyball/core/animation.hpp>
#include <flyball/study/localize.hpp>

namespace flyball::study {

/// The robot on its map as it moves along the best path that was found, dashed where it truly was
/// if that is known. @param clock  Of the plots over the same time.
[[nodiscard]] std::vector<Animation> localize_animation(const LocalizeResult& result,
                                                        std::string section, std::string clock);

}  // namespace flyball::study
