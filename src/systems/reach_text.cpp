#include <cmath>

#include <flyball/systems/controllability.hpp>

#include "core/format.hpp"
#include "systems/modes.hpp"

namespace flyball {

namespace {

using Eigen::Index;

std::string name_of(Index k, std::span<const std::string> names) {
  const auto index = static_cast<std::size_t>(k);
  return index < names.size() ? names[index] : detail::format("x{}", k + 1);
}

/// "x1", "0.71 x1 - 0.71 x2".
std::string combination(const Eigen::VectorXd& w, std::span<const std::string> names) {
  const double largest = w.size() > 0 ? w.cwiseAbs().maxCoeff() : 0.0;
  std::vector<Index> parts;
  for (Index k = 0; k < w.size(); ++k) {
    if (std::abs(w(k)) > 1e-6 * largest) {
      parts.push_back(k);
    }
  }
  if (parts.empty()) {
    return "no state";
  }
  if (parts.size() == 1) {
    return name_of(parts.front(), names);
  }
  const double sign = w(parts.front()) < 0.0 ? -1.0 : 1.0;
  std::string text;
  for (const Index k : parts) {
    const double value = sign * w(k);
    text += text.empty() ? (value < 0.0 ? "-" : "") : (value < 0.0 ? " - " : " + ");
    text += format_number(std::abs(value), 3) + ' ' + name_of(k, names);
  }
  return text;
}

/// "mostly x1 and x2".
std::string owners(const Eigen::VectorXd& participation, std::span<const std::string> names) {
  std::string text;
  for (Index k = 0; k < participation.size(); ++k) {
    if (participation(k) >= 0.25) {
      text += (text.empty() ? "" : ", ") + name_of(k, names);
    }
  }
  return text.empty() ? "all states together" : text;
}

/// For words only: parts that are rounding beside the other eigenvalues are zero.
std::complex<double> without_rounding(std::complex<double> eigenvalue, double scale) {
  constexpr double rounding = 1e-12;
  const auto part = [&](double value) { return std::abs(value) < rounding * scale ? 0.0 : value; };
  return {part(eigenvalue.real()), part(eigenvalue.imag())};
}

struct Words {
  std::string_view verb;     ///< "no input moves"
  std::string_view reached;  ///< "reached by the inputs"
  std::string_view weak;     ///< "an input barely moves"
};

std::string describe(const ReachAnalysis& analysis, std::string_view headline, const Words& words,
                     std::span<const std::string> names) {
  std::string text = detail::format("{}: {} of {} states {}\n", headline, analysis.rank,
                                    analysis.order, words.reached);
  for (Index k = 0; k < analysis.hidden.cols(); ++k) {
    text += detail::format("{} {}\n", words.verb, combination(analysis.hidden.col(k), names));
  }
  double scale = 0.0;
  for (const ModeReach& mode : analysis.modes) {
    scale = std::max(scale, std::abs(mode.eigenvalue));
  }
  for (const ModeReach& mode : analysis.modes) {
    if (mode.eigenvalue.imag() < 0.0) {
      continue;
    }
    const std::string pole = detail::pole_text(without_rounding(mode.eigenvalue, scale));
    if (!mode.reached) {
      text += detail::format("{} the mode {} ({}; {})\n", words.verb, pole,
                             to_string(mode.stability), owners(mode.participation, names));
    } else {
      constexpr double weak = 1e-6;
      text += detail::format("{} {} ({}; {}): distance {} from being cut off\n",
                             mode.distance < weak ? words.weak : std::string_view("mode"), pole,
                             to_string(mode.stability), owners(mode.participation, names),
                             format_number(mode.distance, 2));
    }
  }
  return text;
}

}  // namespace

std::string describe(const ControllabilityAnalysis& analysis, std::span<const std::string> states) {
  return describe(analysis,
                  analysis.controllable   ? "controllable"
                  : analysis.stabilizable ? "not controllable, but stabilizable"
                                          : "not controllable, nor stabilizable",
                  {"no input moves", "are reached by the inputs", "an input barely moves the mode"},
                  states);
}

std::string describe(const ObservabilityAnalysis& analysis, std::span<const std::string> states) {
  return describe(analysis,
                  analysis.observable   ? "observable"
                  : analysis.detectable ? "not observable, but detectable"
                                        : "not observable, nor detectable",
                  {"no output shows", "are seen by the outputs", "an output barely shows the mode"},
                  states);
}

}  // namespace flyball
