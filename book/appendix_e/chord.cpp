#include <algorithm>

#include <flyball/math/spectra/projection.hpp>

#include "book/appendix_e/chord.hpp"
#include "book/drawing.hpp"
#include "book/figure_functions.hpp"

namespace flyball::book {

using namespace flyball::literals;

namespace {

using std::numbers::pi;

constexpr int chord_samples = 50001;  // 50 ms of 1 µs

std::vector<double> times() {
  std::vector<double> t;
  for (int k = 0; k < chord_samples; ++k) {
    t.push_back(k * 1e-6);
  }
  return t;
}

std::vector<double> sounds(const Tone& tone, const std::vector<double>& t) {
  std::vector<double> y;
  for (const double at : t) {
    y.push_back(sound(tone, at));
  }
  return y;
}

std::vector<double> chord_of(const std::vector<double>& t) {
  std::vector<double> sum(t.size(), 0.0);
  for (const Tone& tone : chord) {
    for (std::size_t k = 0; k < t.size(); ++k) {
      sum[k] += sound(tone, t[k]);
    }
  }
  return sum;
}

/// Columns below each other, of which the picture shows each 50th row.
Plot panels_of(const FigureResult& figure, const std::vector<std::string>& labels) {
  Plot plot{.title = figure.title, .x_label = "Time (s)"};
  for (std::size_t i = 1; i < figure.columns.size(); ++i) {
    PlotLine line{.color = i == 1 ? 0 : static_cast<int>(i) - 1};
    for (std::size_t k = 0; k < figure.columns[0].values.size(); k += 50) {
      line.x.push_back(figure.columns[0].values[k]);
      line.y.push_back(figure.columns[i].values[k]);
    }
    plot.panels.push_back({.y_label = labels[i - 1], .lines = {std::move(line)}});
  }
  return plot;
}

}  // namespace

/// Figure E.10: the chord F, A, C of the fourth octave, and the three sines that it is (section
/// E.3.2).
FigureResult figure_E_10() {
  const std::vector<double> t = times();
  FigureResult figure{.id = "E.10", .title = "Frequency decomposition of a chord"};
  figure.columns = {{"time", "s", t}, {"chord", "", chord_of(t)}};
  std::vector<std::string> labels{"Fmaj4"};
  for (const Tone& tone : chord) {
    figure.columns.push_back({tone.name, "", sounds(tone, t)});
    labels.emplace_back(tone.name);
  }
  figure.picture = panels_of(figure, labels);
  return figure;
}

/// Figure E.11: the chord's Fourier transform: three lines of height one (section E.3.2). A million
/// samples of 0.5 ms hold a whole number of each tone's periods. The book's script draws line k at
/// 1000 k/(N/2 - 1) Hz; it belongs to k/(N T).
FigureResult figure_E_11() {
  constexpr int N = 1000000;
  const Time period = 0.5_ms;
  Eigen::VectorXd x = Eigen::VectorXd::Zero(N);
  for (int k = 0; k < N; ++k) {
    for (const Tone& tone : chord) {
      x(k) += sound(tone, k * period.si());
    }
  }
  const AmplitudeSpectrum spectrum = amplitude_spectrum(x, period).value();

  FigureResult figure{.id = "E.11", .title = "Fourier transform of a chord"};
  std::vector<double> frequency;
  std::vector<double> drawn;
  std::vector<double> magnitude;
  PlotLine line{.color = 0};
  for (int k = 0; k < N / 2; ++k) {
    frequency.push_back(spectrum.frequency(k) / (2.0 * pi));
    drawn.push_back(k * (1000.0 / (N / 2 - 1)));
    // The script doubles the mean, too, which is zero.
    magnitude.push_back(std::abs(spectrum.amplitude(k)) * (k == 0 ? 2.0 : 1.0));
    const bool near = std::ranges::any_of(
        chord, [&](const Tone& tone) { return std::abs(frequency.back() - tone.hertz) < 0.0045; });
    if (k % 500 == 0 || near) {
      line.x.push_back(frequency.back());
      line.y.push_back(magnitude.back());
    }
  }
  PlotPanel panel{.y_label = "Amplitude", .lines = {std::move(line)}};
  for (const Tone& tone : chord) {
    const auto bin = static_cast<int>(std::lround(tone.hertz * N * period.si()));
    figure.numbers.push_back(
        {std::string("amplitude_") + tone.name, "", magnitude[static_cast<std::size_t>(bin)]});
    figure.numbers.push_back(
        {std::string("frequency_") + tone.name, "Hz", frequency[static_cast<std::size_t>(bin)]});
    panel.notes.push_back({tone.hertz + 8.0, 0.9, tone.name});
  }
  figure.columns = {{"frequency", "Hz", std::move(frequency)},
                    {"script_frequency", "Hz", std::move(drawn)},
                    {"magnitude", "", std::move(magnitude)}};
  figure.picture =
      Plot{.title = figure.title, .x_label = "Frequency (Hz)", .panels = {std::move(panel)}};
  return figure;
}

/// Figure E.13: the chord with its frequencies moved to σ = -25: times e^(-25t) (section E.3.3).
FigureResult figure_E_13() {
  const std::vector<double> t = times();
  std::vector<double> steady = chord_of(t);
  std::vector<double> fading;
  for (std::size_t k = 0; k < t.size(); ++k) {
    fading.push_back(steady[k] * std::exp(-25.0 * t[k]));
  }
  FigureResult figure{.id = "E.13", .title = "A chord at σ = 0 and at σ = −25"};
  figure.columns = {
      {"time", "s", t}, {"sigma_0", "", std::move(steady)}, {"sigma_-25", "", std::move(fading)}};
  figure.picture = panels_of(figure, {"Fmaj4 (σ = 0)", "Attenuating Fmaj4 (σ = −25)"});
  return figure;
}

}  // namespace flyball::book
