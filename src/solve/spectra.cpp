#include <cmath>
#include <complex>
#include <vector>

#include <flyball/identification/frequency_fit.hpp>
#include <flyball/math/spectra/excitation.hpp>
#include <flyball/math/spectra/fft.hpp>
#include <flyball/math/spectra/welch.hpp>

#include "core/try.hpp"
#include "solve/row.hpp"

// Spectra, frequency responses, and signals to measure them with.
namespace flyball::solve {

namespace {

using Eigen::Index;
using Eigen::MatrixXcd;
using Eigen::MatrixXd;

Expected<WelchOptions> welch_options(const Problem& problem) {
  WelchOptions options;
  options.length = problem.has("length") ? problem.integer("length") : 0;
  options.overlap = problem.number("overlap");
  for (const Window window : {Window::rectangular, Window::hann, Window::hamming, Window::blackman,
                              Window::blackman_harris, Window::flat_top}) {
    if (to_string(window) == problem.choice("window")) {
      options.window = window;
    }
  }
  options.remove_mean = problem.choice("mean") == "removed";
  return options;
}

Outcome solve_fft(const Problem& problem, JsonWriter& answer) {
  const Eigen::VectorXcd& x = problem.complex_list("x");
  FLYBALL_TRY(const Eigen::VectorXcd X,
              problem.choice("direction") == "forward" ? fft(x) : inverse_fft(x));
  answer.add("X", X);
  return {};
}

Outcome solve_spectrum(const Problem& problem, JsonWriter& answer) {
  FLYBALL_TRY(const WelchOptions options, welch_options(problem));
  FLYBALL_TRY(const PowerSpectrum power,
              welch(problem.matrix("x"), Time(problem.number("T")), options));
  answer.add("frequency", power.frequency);
  answer.add("density", power.density);
  answer.add("averages", power.averages);
  return {};
}

Outcome solve_frequency_response(const Problem& problem, JsonWriter& answer) {
  FLYBALL_TRY(const WelchOptions options, welch_options(problem));
  FLYBALL_TRY(
      const FrequencyResponseEstimate estimate,
      estimate_frequency_response(
          problem.matrix("u"), problem.matrix("y"), Time(problem.number("T")), options,
          problem.choice("estimator") == "h2" ? ResponseEstimator::h2 : ResponseEstimator::h1,
          problem.number("confidence")));
  std::vector<MatrixXd> real;
  std::vector<MatrixXd> imaginary;
  for (const MatrixXcd& G : estimate.response) {
    real.emplace_back(G.real());
    imaginary.emplace_back(G.imag());
  }
  answer.add("frequency", estimate.frequency);
  answer.add("real", real);
  answer.add("imaginary", imaginary);
  answer.add("radius", estimate.radius);
  answer.add("coherence", estimate.coherence);
  answer.add("averages", estimate.averages);
  return {};
}

Outcome solve_fit(const Problem& problem, JsonWriter& answer) {
  const Eigen::VectorXcd& G = problem.complex_list("G");
  std::vector<MatrixXcd> response;
  for (const std::complex<double>& value : G) {
    response.push_back(MatrixXcd::Constant(1, 1, value));
  }
  identification::FrequencyFitOptions options;
  options.poles = problem.integer("poles");
  options.stable = problem.choice("stability") == "stable";
  options.feedthrough = problem.choice("feedthrough") == "yes";
  if (problem.has("weights")) {
    options.weights = problem.matrix("weights");
  }
  const auto write = [&](const auto& fit) {
    write_system(fit.system, answer);
    answer.add("poles", fit.poles);
    answer.add("fit_error", fit.error);
  };
  const Eigen::VectorXd frequency = problem.matrix("frequency");
  if (problem.has("T")) {
    return identification::fit_frequency_response(frequency, response, Time(problem.number("T")),
                                                  options)
        .map(write);
  }
  return identification::fit_frequency_response(frequency, response, options).map(write);
}

Outcome solve_multisine(const Problem& problem, JsonWriter& answer) {
  FLYBALL_CHECK(
      check_size(static_cast<double>(problem.integer("samples")), "multisine", "samples"));
  FLYBALL_TRY(
      const Multisine signal,
      multisine(problem.integer("samples"),
                {problem.integer("first"), problem.integer("last"), problem.integer("step")},
                problem.number("amplitude"), static_cast<std::uint64_t>(problem.integer("seed"))));
  answer.add("u", signal.u);
  answer.add("crest_factor", signal.crest_factor);
  return {};
}

Outcome solve_prbs(const Problem& problem, JsonWriter& answer) {
  const double periods = std::exp2(static_cast<double>(problem.integer("bits"))) - 1.0;
  FLYBALL_CHECK(check_size(periods * static_cast<double>(problem.integer("hold")), "prbs", "bits"));
  FLYBALL_TRY(const Eigen::VectorXd u,
              prbs(problem.integer("bits"), problem.integer("hold"), problem.number("amplitude"),
                   static_cast<std::uint64_t>(problem.integer("seed"))));
  answer.add("u", u);
  return {};
}

Outcome solve_chirp(const Problem& problem, JsonWriter& answer) {
  FLYBALL_TRY(
      const Eigen::VectorXd u,
      chirp(problem.integer("samples"), Time(problem.number("T")), problem.number("first"),
            problem.number("last"), problem.number("amplitude"),
            problem.choice("shape") == "linear" ? ChirpShape::linear : ChirpShape::logarithmic));
  FLYBALL_CHECK(check_size(static_cast<double>(u.size()), "chirp", "samples"));
  answer.add("u", u);
  return {};
}

}  // namespace

std::vector<Kind> spectrum_kinds() {
  using namespace field;
  const Field T = number("T", "s", "sample period");
  const Field u = samples("u", "k", "m", "the inputs, a row a sample");
  const Field y = samples("y", "k", "p", "the outputs, recorded with them");
  const std::vector<Field> welch{
      optional(integer("length", "samples of a stretch; eight half overlapping ones if left out")),
      or_number(number("overlap", "", "share of a stretch that is in the next one, too"), 0.5),
      or_first(choice("window", "hann rectangular hamming blackman blackman-harris flat-top",
                      "how each stretch is faded in and out")),
      or_first(choice("mean", "removed kept", "whether each stretch loses its mean"))};
  const Field amplitude = or_number(number("amplitude", "", "the largest value"), 1.0);
  const Field seed = or_number(integer("seed", "another number, another signal"), 1.0);
  const Field out = list("u", "l", "", "the signal");
  const Field frequency = list("frequency", "w", "rad/s", "from 0 to half the sample rate");
  const Field averages = number("averages", "", "as many independent stretches would be as good");
  return {
      {"fft",
       "X_k = Σ x_j e^(-2πi jk/n), or its inverse",
       {complex_list("x", "k", "the samples; real ones may be plain numbers"),
        or_first(choice("direction", "forward inverse", "which way"))},
       {complex_list("X", "k", "the transform")},
       R"({"x": [1, 2, 3, 4, 5]})",
       &solve_fft},
      {"power-spectrum",
       "the density of a signal's power over frequency, by Welch's averages",
       std::vector{samples("x", "k", "1", "the signal"), T} + welch,
       {frequency, list("density", "w", "unit²/Hz", "one-sided"), averages},
       R"({"x": [1, -1, 2, 0, 1, -2, 0, 1, 1, -1, 2, -2], "T": 0.1, "length": 4})",
       &solve_spectrum},
      {"frequency-response",
       "G of y = G u from a record, by averaged spectra, with coherence and how far it may be off",
       std::vector{u, y, T} + welch +
           std::vector{or_first(choice("estimator", "h1 h2", "noise in y alone, or in u alone")),
                       or_number(number("confidence", "", "of the radius"), 0.95)},
       {frequency, unbounded(matrices("real", "p", "m", "of G, a matrix a frequency")),
        unbounded(matrices("imaginary", "p", "m", "of G")),
        unbounded(matrices("radius", "p", "m", "the true G is this near, with the confidence")),
        matrix("coherence", "w", "p", "share of each output that the inputs explain"), averages},
       R"({"u": [1, -1, 2, 0, 1, -2, 0, 1, 1, -1, 2, -2], "y": [0, 1, -1, 2, 0, 1, -2, 0, 1, 1, -1, 2], "T": 0.1, "length": 4})",
       &solve_frequency_response},
      {"fit-frequency-response",
       "the rational system nearest to a frequency response, in states (E.7)",
       {list("frequency", "w", "rad/s", "increasing"), complex_list("G", "w", "the response there"),
        integer("poles", "how many"),
        optional(number("T", "s", "sample period of a discrete system; a continuous one without")),
        optional(list("weights", "w", "", "what an error counts, as 1/deviation")),
        or_first(choice("stability", "stable as-found", "whether unstable poles are reflected")),
        or_first(choice("feedthrough", "yes no", "whether D is fitted, or zero"))},
       answered_system("n", "1", "1") +
           std::vector{complex_list("poles", "n", "of the system"),
                       number("fit_error", "", "√(Σ |w (G - Ĝ)|² / Σ |w G|²)")},
       R"({"frequency": [0, 1, 2, 4], "G": [1, [0.5, -0.5], [0.2, -0.4], [0.0588235294117647, -0.235294117647059]], "poles": 1})",
       &solve_fit},
      {"multisine",
       "one period of a sum of sines of equal amplitude with a low crest factor",
       {integer("samples", "of the period"), or_number(integer("first", "harmonic"), 1.0),
        integer("last", "harmonic, below half the samples"),
        or_number(integer("step", "from harmonic to harmonic"), 1.0), amplitude, seed},
       {out, number("crest_factor", "", "largest value over root mean square")},
       R"({"samples": 16, "last": 3})",
       &solve_multisine},
      {"prbs",
       "a pseudo-random binary sequence of 2^bits - 1 values",
       {integer("bits", "from 2 to 24"),
        or_number(integer("hold", "samples for which each value stays"), 1.0), amplitude, seed},
       {out},
       R"({"bits": 3})",
       &solve_prbs},
      {"chirp",
       "a sine that sweeps from one frequency to another",
       {integer("samples", "how many"), T, number("first", "rad/s", "frequency at the start"),
        number("last", "rad/s", "frequency at the end"), amplitude,
        or_first(choice("shape", "logarithmic linear", "how the frequency goes"))},
       {out},
       R"({"samples": 10, "T": 0.1, "first": 1, "last": 10})",
       &solve_chirp},
  };
}

}  // namespace flyball::solve
