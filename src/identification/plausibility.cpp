#include <algorithm>
#include <array>
#include <cmath>
#include <string>

#include "core/diagnose.hpp"
#include "core/format.hpp"
#include "core/try.hpp"
#include "identification/plausibility.hpp"

namespace flyball::identification {
namespace {

using mechanisms::MechanismKind;

constexpr double nominal = 12.0;  // V

/// Speeds at 12 V, m/s or rad/s: what is built, and what any motor at any sane gearing can make
/// (the fastest turn 2000 rad/s; four times that is geared up further than anything that is built).
struct Speeds {
  double least;
  double most;
  double slowest;
  double fastest;
};

Speeds speeds_of(MechanismKind kind, bool linear) {
  if (linear) {
    return kind == MechanismKind::flywheel || kind == MechanismKind::roller
               ? Speeds{0.3, 150.0, 0.003, 800.0}
               : Speeds{0.02, 12.0, 0.002, 40.0};
  }
  return controls_velocity(kind) ? Speeds{20.0, 2000.0, 1.0, 8000.0}
                                 : Speeds{0.1, 60.0, 0.01, 1000.0};
}

constexpr double whole_duty = 1.05;  // Of what is a duty cycle, if it is one, with its noise.

/// What positions, or a voltage that is nowhere above `largest`, may be in truth, by how far the
/// speed is off.
std::string cause(double speed, const Speeds& speeds, bool linear, double largest) {
  struct Mistake {
    double factor;  ///< The true speed over the one that the log says.
    const char* text;
  };
  static constexpr std::array angles{
      Mistake{6.283185307179586, "positions in rotations that were taken for radians"},
      Mistake{0.15915494309189535, "positions in radians that were taken for rotations"},
      Mistake{57.29577951308232, "positions in radians that were taken for degrees"},
      Mistake{0.017453292519943295, "positions in degrees that were taken for radians"},
      Mistake{360.0, "positions in rotations that were taken for degrees"},
      Mistake{1.0 / 360.0, "positions in degrees that were taken for rotations"},
      Mistake{0.02, "an encoder on the motor, before a gearing of some 50"}};
  static constexpr std::array lengths{
      Mistake{0.0254, "positions in inches that were taken for metres"},
      Mistake{0.01, "positions in centimetres that were taken for metres"},
      Mistake{39.37007874015748, "positions in metres that were taken for inches"},
      Mistake{0.05, "positions in rotations or radians of a drum that were taken for metres"}};
  const auto fits = [&](const Mistake& mistake) {
    return speed * mistake.factor >= speeds.least && speed * mistake.factor <= speeds.most;
  };
  const auto all = [&](const auto& mistakes) {
    static constexpr Mistake duty{1.0 / nominal,
                                  "a duty cycle from -1 to 1 that was taken for volts "
                                  "(--voltage-scale 12)"};
    if (largest <= whole_duty && fits(duty)) {
      return std::string(duty.text);
    }
    std::string text;
    for (const Mistake& mistake : mistakes) {
      if (fits(mistake)) {
        text += (text.empty() ? "" : ", or ") + std::string(mistake.text);
      }
    }
    return text.empty() ? std::string("positions or voltages in another unit") : text;
  };
  return linear ? all(lengths) : all(angles);
}

}  // namespace

Expected<void> check_plausibility(const PreparedRecording& prepared, const FeedforwardFit& fit,
                                  std::vector<Diagnostic>& diagnostics) {
  const bool linear = fit.unit == "m";
  const Speeds speeds = speeds_of(fit.mechanism, linear);
  const double held = fit.kG ? std::abs(fit.kG->value) : 0.0;
  const double speed = nominal / fit.kV.value;
  double largest = 0.0;
  for (const PreparedRun& run : prepared.runs) {
    for (const double volts : run.run.voltage) {
      largest = std::max(largest, std::abs(volts));
    }
  }
  const bool arm = fit.mechanism == MechanismKind::arm;
  const double resisted = fit.kS.value + held;
  // An arm need not have been level in the log.
  const double moved_it = arm ? std::max(nominal, largest) : std::max(1.05 * largest, 0.5);
  if (resisted > moved_it && (!fit.kG || fit.kG->determined)) {
    return refusal(IdentificationError::unphysical_gains, "identify", fit.kG ? "kS + kG" : "kS")
        .got(detail::format("{:.4g} V", resisted))
        .expected(arm ? detail::format("below the {:.3g} V that move it", moved_it)
                      : detail::format("below the {:.3g} V that moved it in the log", largest))
        .hint("probable cause: " + cause(speed, speeds, linear, largest) +
              "; say the unit with --unit, and --voltage-scale if the voltage is none");
  }
  if (speed < speeds.slowest || speed > speeds.fastest) {
    return refusal(IdentificationError::unphysical_gains, "identify", "the speed at 12 V")
        .got(detail::format("{:.4g} {}/s (kV = {:.4g} V·s/{})", speed, fit.unit, fit.kV.value,
                            fit.unit))
        .expected(detail::format("between {:.3g} and {:.3g}, as motors and gearings make it",
                                 speeds.slowest, speeds.fastest))
        .hint("probable cause: " + cause(speed, speeds, linear, largest) +
              "; say the unit with --unit");
  }
  if (speed < speeds.least || speed > speeds.most) {
    warn(diagnostics, "unusual_speed",
         "the gains make {:.3g} {}/s at 12 V, which few mechanisms of the kind reach ({:.3g} to "
         "{:.3g}); if that is not so, the probable cause is {}; say the unit with --unit",
         speed, fit.unit, speeds.least, speeds.most, cause(speed, speeds, linear, largest));
  }
  return {};
}

}  // namespace flyball::identification
