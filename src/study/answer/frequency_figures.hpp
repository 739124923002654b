#pragma once

#include <optional>
#include <string>
#include <vector>

#include <flyball/core/figure.hpp>
#include <flyball/study/frequency_points.hpp>

namespace flyball::study {

/// A loop that was opened, and what is said of it in its pictures.
struct OpenedLoop {
  std::string section{};  ///< Where they stand.
  std::string name{};     ///< Added to the pictures' names: "", "_torque".
  std::string where{};    ///< Added to their titles: "", " at torque".
  std::vector<FrequencyPoint> response{};
  std::optional<double> crossover{};     ///< rad/s, of the gain, that limits the phase.
  std::optional<double> phase_margin{};  ///< rad, said there.
  std::optional<double> gain_margin{};   ///< A ratio, said where the phase is -180°.
  std::optional<double> turned{};  ///< rad/s, where that is; absent: where it first falls to it.
};

/// Gain and phase over frequency, with the margins.
[[nodiscard]] Figure bode_figure(const OpenedLoop& loop);
/// The same in the complex plane about −1.
[[nodiscard]] Figure nyquist_figure(const OpenedLoop& loop);

/// A response in the complex plane, cut off far from the origin, with its mirror image, −1 and the
/// circle of a gain of one. @param label  Of the curve.
[[nodiscard]] Plot nyquist_plot(std::string title, std::string label,
                                const std::vector<FrequencyPoint>& response);

/// Panels of gain (dB) and phase (°), without their curves.
[[nodiscard]] Plot bode_plot(std::string title);
/// Adds one response to them. @param color  Of the palette. @param label  May be empty.
void add_response(Plot& bode, const std::vector<FrequencyPoint>& response, std::string label,
                  int color);

}  // namespace flyball::study
