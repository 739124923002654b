#include <complex>
#include <vector>

#include <flyball/classical/filters/fir_design.hpp>
#include <flyball/classical/filters/sample_rate.hpp>
#include <flyball/classical/filters/simple_filters.hpp>
#include <flyball/math/spectra/projection.hpp>

#include "core/try.hpp"
#include "solve/row.hpp"

// Filters, changes of the sample rate, and signals in other bases.
namespace flyball::solve {

namespace {

using namespace classical;
using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

template <class Choice, std::size_t N>
Choice chosen(const Problem& problem, std::string_view field, const Choice (&all)[N]) {
  for (const Choice choice : all) {
    if (to_string(choice) == problem.choice(field)) {
      return choice;
    }
  }
  return all[0];
}

constexpr FilterFamily families[] = {FilterFamily::butterworth, FilterFamily::chebyshev1,
                                     FilterFamily::chebyshev2, FilterFamily::elliptic,
                                     FilterFamily::bessel};
constexpr FilterBand bands[] = {FilterBand::low_pass, FilterBand::high_pass, FilterBand::band_pass,
                                FilterBand::band_stop};
constexpr Window windows[] = {Window::hamming,         Window::hann,
                              Window::rectangular,     Window::blackman,
                              Window::blackman_harris, Window::flat_top};

MatrixXd rows_of(const std::vector<Biquad>& sections) {
  MatrixXd rows(static_cast<Index>(sections.size()), 6);
  for (std::size_t i = 0; i < sections.size(); ++i) {
    const Biquad& c = sections[i];
    rows.row(static_cast<Index>(i)) << c.b0, c.b1, c.b2, 1.0, c.a1, c.a2;
  }
  return rows;
}

std::optional<Time> period_of(const Problem& problem) {
  return problem.has("T") ? std::optional(Time(problem.number("T"))) : std::nullopt;
}

/// The roots, and of a digital filter its sections.
Outcome write_filter(const IirDesign& design, std::optional<Time> period, JsonWriter& answer) {
  if (!period) {
    return design_analog_filter(design).map([&](const AnalogFilter& filter) {
      answer.add("zeros", filter.zeros);
      answer.add("poles", filter.poles);
      answer.add("gain", filter.gain);
    });
  }
  return design_filter(design, *period).map([&](const DigitalFilter& filter) {
    answer.add("zeros", filter.zeros);
    answer.add("poles", filter.poles);
    answer.add("gain", filter.gain);
    answer.add("sections", rows_of(filter.sections));
  });
}

Outcome solve_filter(const Problem& problem, JsonWriter& answer) {
  const IirDesign design{
      .family = chosen(problem, "family", families),
      .band = chosen(problem, "band", bands),
      .order = problem.integer("order"),
      .frequency = problem.number("frequency"),
      .upper_frequency = problem.has("upper_frequency") ? problem.number("upper_frequency") : 0.0,
      .ripple = problem.number("ripple"),
      .attenuation = problem.number("attenuation")};
  return write_filter(design, period_of(problem), answer);
}

/// One edge, or two.
Expected<std::array<double, 2>> edges_of(const Problem& problem, std::string_view name) {
  const MatrixXd& list = problem.matrix(name);
  const bool two = problem.choice("band").starts_with("band");
  FLYBALL_CHECK(check_shape(list, two ? 2 : 1, 1, "filter-order", name,
                            two ? "the lower and the upper edge" : "one edge"));
  return std::array{list(0, 0), two ? list(1, 0) : 0.0};
}

Outcome solve_order(const Problem& problem, JsonWriter& answer) {
  FLYBALL_TRY(const auto pass, edges_of(problem, "pass"));
  FLYBALL_TRY(const auto stop, edges_of(problem, "stop"));
  FLYBALL_TRY(const FilterOrder order,
              filter_order(chosen(problem, "family", families), chosen(problem, "band", bands),
                           {.pass = pass,
                            .stop = stop,
                            .ripple = problem.number("ripple"),
                            .attenuation = problem.number("attenuation")},
                           period_of(problem)));
  answer.add("order", order.design.order);
  answer.add("exact_order", order.exact);
  answer.add("frequency", order.design.frequency);
  if (order.design.upper_frequency > 0.0) {
    answer.add("upper_frequency", order.design.upper_frequency);
  }
  return write_filter(order.design, period_of(problem), answer);
}

Outcome solve_fir(const Problem& problem, JsonWriter& answer) {
  FLYBALL_CHECK(check_size(static_cast<double>(problem.integer("taps")), "fir", "taps"));
  const FirDesign design{
      .band = chosen(problem, "band", bands),
      .taps = problem.integer("taps"),
      .frequency = problem.number("frequency"),
      .upper_frequency = problem.has("upper_frequency") ? problem.number("upper_frequency") : 0.0};
  const Time period(problem.number("T"));
  FLYBALL_TRY(const VectorXd b,
              problem.has("beta") ? design_fir(design, period, problem.number("beta"))
                                  : design_fir(design, period, chosen(problem, "window", windows)));
  answer.add("b", b);
  answer.add("delay", 0.5 * static_cast<double>(b.size() - 1) * period.si());
  return {};
}

Outcome solve_savitzky_golay(const Problem& problem, JsonWriter& answer) {
  FLYBALL_CHECK(check_size(static_cast<double>(problem.integer("taps")), "savitzky-golay", "taps"));
  SavitzkyGolay fit{.taps = problem.integer("taps"),
                    .degree = problem.integer("degree"),
                    .derivative = problem.integer("derivative")};
  fit.at = problem.has("at") ? problem.number("at") : 0.5 * static_cast<double>(fit.taps - 1);
  const Time period(problem.number("T"));
  FLYBALL_TRY(const VectorXd b, savitzky_golay(fit, period));
  answer.add("b", b);
  if (problem.has("x")) {
    FLYBALL_TRY(const VectorXd y, smooth(problem.matrix("x"), fit, period));
    answer.add("y", y);
  }
  return {};
}

Outcome solve_signal(const Problem& problem, JsonWriter& answer) {
  const MatrixXd& rows = problem.matrix("sections");
  std::vector<Biquad> sections;
  for (Index i = 0; i < rows.rows(); ++i) {
    if (rows(i, 3) != 1.0) {
      return refusal(ArgumentError::malformed, "filter-signal", "sections")
          .got("with a0 = " + format_number(rows(i, 3)))
          .expected("rows b0 b1 b2 1 a1 a2");
    }
    sections.push_back({rows(i, 0), rows(i, 1), rows(i, 2), rows(i, 4), rows(i, 5)});
  }
  const MatrixXd& x = problem.matrix("x");
  const auto write = [&](const VectorXd& y) { answer.add("y", y); };
  if (problem.choice("way") == "zero-phase") {
    return filter_zero_phase(sections, x).map(write);
  }
  return filter_signal(sections, x,
                       problem.choice("start") == "rest" ? FilterStart::rest : FilterStart::steady)
      .map(write);
}

Outcome solve_resample(const Problem& problem, JsonWriter& answer) {
  const int up = problem.integer("up");
  const int down = problem.integer("down");
  const MatrixXd& x = problem.matrix("x");
  FLYBALL_CHECK(
      check_size(static_cast<double>(x.rows()) * up / std::max(down, 1), "resample", "up"));
  return resample(x, up, down, problem.choice("outside") == "line").map([&](const VectorXd& y) {
    answer.add("y", y);
  });
}

Outcome solve_anti_aliasing(const Problem& problem, JsonWriter& answer) {
  FLYBALL_TRY(
      const AntiAliasingAdvice advice,
      advise_anti_aliasing(
          Time(problem.number("T")),
          {.band = problem.number("band"),
           .attenuation = problem.number("attenuation"),
           .ripple = problem.number("ripple"),
           .family = chosen(problem, "family", families)},
          problem.has("source") ? std::optional(Time(problem.number("source"))) : std::nullopt));
  answer.add("nyquist_frequency", advice.nyquist_frequency);
  answer.add("first_alias", advice.first_alias);
  answer.add("order", advice.design.order);
  answer.add("frequency", advice.design.frequency);
  answer.add("attenuation", advice.attenuation);
  answer.add("loss", advice.loss);
  answer.add("phase_lag", advice.phase_lag);
  answer.add("delay", advice.delay);
  answer.add("sampling_phase_lag", advice.sampling_phase_lag);
  answer.add("fir_taps", static_cast<int>(advice.fir_taps));
  answer.add("fir_delay", advice.fir_delay);
  return {};
}

Outcome solve_laplace(const Problem& problem, JsonWriter& answer) {
  return laplace_transform(
             problem.matrix("x"), Time(problem.number("T")), problem.complex_list("s"),
             problem.choice("between") == "hold" ? Interpolation::hold : Interpolation::linear)
      .map([&](const Eigen::VectorXcd& X) { answer.add("X", X); });
}

Outcome solve_coordinates(const Problem& problem, JsonWriter& answer) {
  FLYBALL_TRY(const Coordinates found, coordinates(problem.matrix("basis"), problem.matrix("v")));
  answer.add("along", found.along);
  answer.add("orthogonal", found.orthogonal);
  answer.add("rest", found.rest);
  return {};
}

Outcome solve_tones(const Problem& problem, JsonWriter& answer) {
  FLYBALL_TRY(const Tones found, fit_tones(problem.matrix("x"), Time(problem.number("T")),
                                           problem.matrix("frequency")));
  answer.add("amplitude", found.amplitude);
  answer.add("mean", found.mean);
  answer.add("rest", found.rest);
  return {};
}

}  // namespace

std::vector<Kind> filter_kinds() {
  using namespace field;
  const Field T = number("T", "s", "sample period");
  const Field or_analog =
      optional(number("T", "s", "sample period; without it the filter is analog"));
  const Field family = or_first(
      choice("family", "butterworth chebyshev1 chebyshev2 elliptic bessel", "which prototype"));
  const Field band =
      or_first(choice("band", "low-pass high-pass band-pass band-stop", "what passes"));
  const Field edge = number("frequency", "rad/s", "the edge, or a band's lower one");
  const Field upper = optional(number("upper_frequency", "rad/s", "a band's upper edge"));
  const Field ripple = or_number(number("ripple", "dB", "largest loss in the pass band"), 1.0);
  const Field attenuation =
      or_number(number("attenuation", "dB", "least loss in the stop band"), 40.0);
  const Field x = samples("x", "k", "1", "the signal");
  const Field sections = matrix("sections", "v", "6", "rows b0 b1 b2 1 a1 a2, one after the other");
  const Field y = list("y", "k", "", "the filtered signal");
  const std::vector<Field> filter{
      complex_list("zeros", "z", "of the filter"), complex_list("poles", "n", "of the filter"),
      number("gain", "", "H = gain Π(z - zᵢ)/Π(z - pⱼ)"), optional(sections)};
  const Field b = list("b", "l", "", "the taps, newest sample's first");
  return {
      {"filter",
       "a filter of infinite impulse response, as roots and second-order sections",
       {family, band, integer("order", "1 to 20, of the prototype"), edge, upper, ripple,
        attenuation, or_analog},
       filter,
       R"({"family": "elliptic", "order": 3, "frequency": 20, "ripple": 0.5, "attenuation": 60, "T": 0.01})",
       &solve_filter},
      {"filter-order",
       "the filter of least order that meets a specification",
       {family, band, list("pass", "l", "rad/s", "the pass band's edge, or both"),
        list("stop", "l", "rad/s", "the stop band's edge, or both"), ripple, attenuation,
        or_analog},
       std::vector{integer("order", "the least that will do"),
                   number("exact_order", "", "before it was rounded up"), edge, upper} +
           filter,
       R"({"pass": [20], "stop": [40], "T": 0.01})",
       &solve_order},
      {"fir",
       "a filter of finite impulse response and linear phase, by a window",
       {band, integer("taps", "how many samples it weighs"), edge, upper,
        or_first(choice("window", "hamming hann rectangular blackman blackman-harris flat-top",
                        "by which it is cut")),
        optional(number("beta", "", "of Kaiser's window, in its place")), T},
       {b, number("delay", "s", "of every frequency")},
       R"({"taps": 7, "frequency": 20, "T": 0.05})",
       &solve_fir},
      {"savitzky-golay",
       "the value or derivative of the polynomial that fits the last samples best",
       {integer("taps", "how many samples it fits"), integer("degree", "of the polynomial"),
        or_number(integer("derivative", "of which order; 0 smooths"), 0.0),
        optional(number("at", "", "samples back from the newest; the middle if left out")), T,
        optional(samples("x", "k", "1", "a signal to smooth"))},
       {b, optional(list("y", "k", "", "the signal smoothed, not late"))},
       R"({"taps": 5, "degree": 2, "T": 0.02, "x": [0, 1, 4, 9, 16, 25]})",
       &solve_savitzky_golay},
      {"filter-signal",
       "a signal through second-order sections, late as on a robot or forward and backward",
       {sections, x,
        or_first(choice("way", "causal zero-phase", "once, or forward and backward: not late")),
        or_first(choice("start", "steady rest", "whether samples before the first were like it"))},
       {y},
       R"({"sections": [[0.2, 0, 0, 1, -0.8, 0]], "x": [0, 1, 1, 1]})",
       &solve_signal},
      {"resample",
       "a signal at up/down times its sample rate, not late",
       {x, integer("up", "1 or more"), integer("down", "1 or more"),
        or_first(choice("outside", "zero line",
                        "what it is before and after: zero, or off the line through its ends"))},
       {list("y", "l", "", "⌈samples up/down⌉ samples")},
       R"({"x": [0, 1, 2, 3, 4], "up": 2, "down": 1, "outside": "line"})",
       &solve_resample},
      {"anti-aliasing",
       "the filter that a signal needs before it is sampled, and what it costs (7.1.3)",
       {number("T", "s", "sample period to come"),
        number("band", "rad/s", "up to here the signal shall be right"), attenuation, ripple,
        family, optional(number("source", "s", "sample period so far; analog without it"))},
       {number("nyquist_frequency", "rad/s", "half the sample rate"),
        number("first_alias", "rad/s", "lowest frequency that folds into the band"),
        integer("order", "of the filter, zero where none is needed"), edge,
        unbounded(number("attenuation", "dB", "of the first alias")),
        number("loss", "dB", "at the end of the band"),
        number("phase_lag", "rad", "at the end of the band: off the phase margin of a loop there"),
        number("delay", "s", "of slow signals"),
        number("sampling_phase_lag", "rad", "what the samples cost by themselves, ωT/2"),
        integer("fir_taps", "of a filter of linear phase in its place; zero if analog"),
        number("fir_delay", "s", "its delay")},
       R"({"T": 0.02, "band": 40, "source": 0.001})",
       &solve_anti_aliasing},
      {"laplace-transform",
       "∫ x(t) e^(-st) dt of a sampled signal at points of the plane",
       {x, T, complex_list("s", "w", "the points, 1/s"),
        or_first(choice("between", "linear hold", "what the signal is between samples"))},
       {complex_list("X", "w", "the transform there")},
       R"({"x": [0, 1, 2], "T": 0.5, "s": [1, [0, 2]]})",
       &solve_laplace},
      {"coordinates",
       "a vector's coordinates along the directions of a basis (E.3.1)",
       {matrix("basis", "n", "m", "vectors as columns"), list("v", "n", "", "the vector")},
       {list("along", "m", "", "of each direction w/|w|"),
        flag("orthogonal", "the basis: then these are projections"),
        number("rest", "", "what the basis does not span")},
       R"({"basis": [[1, 1], [1, -1]], "v": [2, 1.5]})",
       &solve_coordinates},
      {"tones",
       "amplitudes and phases of tones of known frequencies in a signal, by least squares",
       {x, T, list("frequency", "w", "rad/s", "of the tones")},
       {complex_list("amplitude", "w", "A e^(jφ) of A cos(ωt + φ)"),
        number("mean", "", "of the signal without them"),
        number("rest", "", "root mean square of what they do not explain")},
       R"({"x": [0, 1, 0, -1, 0, 1, 0, -1], "T": 1, "frequency": [1.5707963267948966]})",
       &solve_tones},
  };
}

}  // namespace flyball::solve
