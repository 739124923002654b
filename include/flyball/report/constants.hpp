#pragma once

#include <string>
#include <string_view>
#include <vector>

#include <flyball/study/design.hpp>

namespace flyball::report {

enum class Language { cpp, java };

/// Constants in the form that a team pastes, for one library in one language.
struct PasteText {
  std::string title;  ///< "WPILib, Java".
  std::string file;   ///< A name for it: "constants/wpilib_java.txt".
  std::string text;   ///< Lines that end in a newline; the unit stands on each line with a number.
};

/// For WPILib 2025, in SI units of the mechanism: kS, kG (V), kV (V·s/unit), kA (V·s²/unit), kP
/// (V/unit; V·s/unit for a flywheel), kD (V·s/unit), and the objects that take them.
/// @param kA_reason  Why kA is not determined; then kA is 0 and the reason stands beside it.
/// @return Empty if the design has no gains per its own unit.
[[nodiscard]] std::string wpilib_constants(const study::DesignResult& design, Language language,
                                           std::string_view kA_reason = {});

/// For CTRE Phoenix 6, a Slot0Configs per rotation of the mechanism, all in volts.
/// @return Empty if the design has no gains per rotation (an elevator without a drum radius).
[[nodiscard]] std::string phoenix_constants(const study::DesignResult& design, Language language,
                                            std::string_view kA_reason = {});

/// For REVLib, per rotation and RPM of the mechanism; says what is in volts and what SPARKs want as
/// a share of the full voltage. A SPARK adds kD (e_k - e_(k-1)) every millisecond without dividing
/// by the time between, so its kD is the one in V/RPM times 60 s/min, over 1 ms, over the voltage.
/// Source: the preset of WPILib's SysId for REV controllers (period 1 ms, not time-normalised).
/// @return Empty if the design has no gains per RPM.
[[nodiscard]] std::string rev_constants(const study::DesignResult& design, Language language,
                                        std::string_view kA_reason = {});

/// All of them that the design has, WPILib first.
[[nodiscard]] std::vector<PasteText> paste_constants(const study::DesignResult& design,
                                                     std::string_view kA_reason = {});

}  // namespace flyball::report
