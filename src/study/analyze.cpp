#include <flyball/study/analyze.hpp>

#include <algorithm>
#include <cmath>
#include <numbers>

#include <fmt/format.h>

#include <flyball/systems/interconnection.hpp>

#include "core/diagnose.hpp"
#include "core/try.hpp"
#include "study/told.hpp"

namespace flyball::study {

namespace {

constexpr Eigen::Index most_steps = 16;  ///< Inputs whose step responses can still be looked at.

Expected<std::vector<StepResponse>> step_responses(const ModelFile& model,
                                                   const ModalAnalysis& modes) {
  const auto& [A, B, C, D] = model.system;
  const bool continuous = model.domain == TimeDomain::continuous;
  const ResponseTimes times = response_times(modes, continuous ? std::nullopt : model.period);
  DiscreteSystem<> sampled{A, B, C, D, times.step};
  if (continuous) {
    FLYBALL_TRY(sampled, discretize(model.system, times.step));
  }
  std::vector<StepResponse> responses;
  for (Eigen::Index input = 0; input < std::min(B.cols(), most_steps); ++input) {
    FLYBALL_TRY(auto response, step_response(sampled, input, times));
    responses.push_back(std::move(response));
  }
  return responses;
}

/// Names for all that have none: an output that is one state has the state's.
void complete_names(ModelFile& model) {
  const ContinuousSystem<>& system = model.system;
  const auto complete = [](std::vector<Coordinate>& names, Eigen::Index count, char letter) {
    for (auto k = static_cast<Eigen::Index>(names.size()); k < count; ++k) {
      names.push_back({.name = fmt::format("{}{}", letter, k + 1)});
    }
  };
  const bool named = !model.states.empty();
  complete(model.states, system.A.rows(), 'x');
  complete(model.inputs, system.B.cols(), 'u');
  for (auto k = static_cast<Eigen::Index>(model.outputs.size()); k < system.C.rows(); ++k) {
    Eigen::Index state = 0;
    const double largest = system.C.row(k).cwiseAbs().maxCoeff(&state);
    const bool is_state = system.C(k, state) == 1.0 && largest == system.C.row(k).lpNorm<1>() &&
                          system.D.row(k).isZero(0.0);
    model.outputs.push_back(named && is_state ? model.states[static_cast<std::size_t>(state)]
                                              : Coordinate{.name = fmt::format("y{}", k + 1)});
  }
}

Expected<SampledAnalysis> sampled_analysis(const ContinuousSystem<>& system, Time period) {
  FLYBALL_TRY(auto discrete, discretize_zoh(system.A, system.B, period));
  FLYBALL_TRY(auto structure, analyze_structure({discrete.A, discrete.B, system.C, system.D},
                                                TimeDomain::discrete, period));
  return analyze_sampling(system, period).map([&](const SamplingAnalysis& sampling) {
    return SampledAnalysis{std::move(structure), std::move(discrete), sampling};
  });
}

/// From a tenth of the slowest mode's frequency to ten times the fastest's, with each mode's own:
/// where little is damped, a peak is narrow.
std::vector<double> shown_frequencies(const ModelFile& model, const ModalAnalysis& modes) {
  constexpr int count = 300;
  constexpr double beyond = 10.0;
  std::vector<double> own;
  for (const Mode& mode : modes.modes) {
    if (mode.natural_frequency > 0.0 && std::isfinite(mode.natural_frequency)) {
      own.push_back(mode.natural_frequency);
      own.push_back(std::abs(mode.s.imag()));
    }
  }
  std::erase(own, 0.0);
  const auto [slowest, fastest] = std::minmax_element(own.begin(), own.end());
  const bool continuous = model.domain == TimeDomain::continuous;
  const double last = !continuous   ? std::numbers::pi / model.period->si()
                      : own.empty() ? beyond
                                    : beyond * *fastest;
  const double first = own.empty() ? last / (beyond * beyond) : *slowest / beyond;
  std::vector<double> frequencies = frequencies_between(std::min(first, 1e-3 * last), last, count);
  for (const double frequency : own) {
    if (frequency > frequencies.front() && frequency < last) {
      frequencies.push_back(frequency);
    }
  }
  std::sort(frequencies.begin(), frequencies.end());
  frequencies.erase(std::unique(frequencies.begin(), frequencies.end()), frequencies.end());
  return frequencies;
}

/// What can be looked at: six channels of a system that is not large.
std::vector<ChannelResponse> frequency_responses(const ModelFile& model,
                                                 const ModalAnalysis& modes) {
  constexpr Eigen::Index most_states = 40;
  constexpr std::size_t most_channels = 6;
  const auto& [A, B, C, D] = model.system;
  if (A.rows() > most_states || B.cols() == 0 || C.rows() == 0) {
    return {};
  }
  std::vector<ChannelResponse> channels;
  for (Eigen::Index output = 0; output < C.rows(); ++output) {
    for (Eigen::Index input = 0; input < B.cols(); ++input) {
      channels.push_back({.input = input, .output = output});
    }
  }
  const bool continuous = model.domain == TimeDomain::continuous;
  const double T = model.period.value_or(Time(1.0)).si();
  const DiscreteSystem<> discrete{A, B, C, D, Time(T)};
  for (const double frequency : shown_frequencies(model, modes)) {
    const auto at = continuous ? transfer_at(model.system, {0.0, frequency})
                               : transfer_at(discrete, std::polar(1.0, frequency * T));
    if (!at) {
      continue;  // a pole
    }
    for (ChannelResponse& channel : channels) {
      append(channel.response, frequency, (*at)(channel.output, channel.input));
    }
  }
  std::erase_if(channels, [](const ChannelResponse& channel) {
    return std::all_of(channel.response.begin(), channel.response.end(),
                       [](const FrequencyPoint& point) { return point.gain == 0.0; });
  });
  channels.resize(std::min(channels.size(), most_channels));
  return channels;
}

void add_gains(ModelAnalysis& analysis) {
  const ContinuousSystem<>& system = analysis.model.system;
  const bool continuous = analysis.model.domain == TimeDomain::continuous;
  const DiscreteSystem<> discrete{system.A, system.B, system.C, system.D,
                                  analysis.model.period.value_or(Time(1.0))};
  if (const auto dc = continuous ? transfer_at(system, 0.0) : transfer_at(discrete, 1.0)) {
    analysis.dc_gain = dc->real();
  }
  if (analysis.modes.stability != Stability::stable) {
    return;
  }
  if (const auto h2 = continuous ? h2_norm(system) : h2_norm(discrete)) {
    analysis.h2_norm = *h2;
  }
  if (const auto peak = continuous ? h_infinity_norm(system) : h_infinity_norm(discrete)) {
    analysis.h_infinity_norm = *peak;
  }
}

Expected<ModelAnalysis> analysis_of(const ModelFile& model) {
  const bool continuous = model.domain == TimeDomain::continuous;
  if (!continuous && !model.period) {
    return refusal(ArgumentError::malformed, "analyze", "period")
        .got("left out")
        .expected("the sample period of the discrete system");
  }
  FLYBALL_TRY(auto structure,
              analyze_structure(model.system, model.domain, model.period.value_or(Time(1.0))));
  ModelAnalysis analysis{std::move(structure), model, {}, {}, {}, {}, {}, {}};
  complete_names(analysis.model);
  if (continuous && model.period) {
    auto sampled = sampled_analysis(model.system, *model.period);
    if (sampled) {
      analysis.sampled = *std::move(sampled);
    } else {
      // The continuous system is what was asked about.
      warn(analysis.model.notes, "not_sampled", "as sampled: {}", to_string(sampled.error()));
    }
  }
  if (auto steps = step_responses(model, analysis.modes)) {
    analysis.steps = *std::move(steps);
  } else {
    // What the system is like does not hang on whether its responses have doubles.
    warn(analysis.model.notes, "no_responses", "without step responses: {}",
         to_string(steps.error()));
  }
  analysis.frequency_responses = frequency_responses(model, analysis.modes);
  add_gains(analysis);
  return analysis;
}

}  // namespace

ExpectedAll<ModelAnalysis> analyze(const ModelFile& model) {
  if (auto analysis = analysis_of(model)) {
    return *std::move(analysis);
  } else {
    return refused("analyze", std::move(analysis).error(), model.notes);
  }
}

}  // namespace flyball::study
