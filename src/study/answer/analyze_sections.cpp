// What a linear system is like, shown.
#include <algorithm>
#include <cmath>

#include <fmt/format.h>

#include "core/wording.hpp"
#include "study/answer/model_parts.hpp"

namespace flyball::study {

namespace {

using text::capitalized;
using text::complex_number;
using text::count;
using text::enumerate;
using text::matrix;
using text::number;
using text::seconds;

constexpr std::size_t most_rows = 40;   ///< Of a table that is read; JSON has them all.
constexpr Eigen::Index most_shown = 8;  ///< States of a matrix that is printed.

bool is_continuous(const ModelAnalysis& result) {
  return result.model.domain == TimeDomain::continuous;
}

std::string shown(const Eigen::MatrixXd& M) {
  return std::max(M.rows(), M.cols()) <= most_shown
             ? matrix(M)
             : fmt::format("{} x {}, see --json", M.rows(), M.cols());
}

std::string named(const std::vector<Coordinate>& coordinates, std::string_view thing) {
  const std::string size = count(coordinates.size(), thing);
  return coordinates.size() <= static_cast<std::size_t>(most_shown)
             ? size + ": " + enumerate(labels(coordinates))
             : size;
}

Section system_section(const ModelAnalysis& result) {
  const ModelFile& model = result.model;
  Section section{"system", "System", {}};
  Facts facts = model.plant ? plant_facts(*model.plant) : Facts{};
  facts.add("time", is_continuous(result)
                        ? std::string("continuous, dx/dt = A x + B u, y = C x + D u")
                        : fmt::format("discrete, x_next = A x + B u, y = C x + D u, each {}",
                                      seconds(model.period->si())));
  facts.add("x", named(model.states, "state"));
  facts.add("u", named(model.inputs, "input"));
  facts.add("y", named(model.outputs, "output"));
  facts.add("A", shown(model.system.A));
  facts.add("B", shown(model.system.B));
  facts.add("C", shown(model.system.C));
  if (!model.system.D.isZero(0.0)) {
    facts.add("D", shown(model.system.D));
  }
  section.blocks.emplace_back(std::move(facts));
  return section;
}

std::string behaviour(const Mode& mode) {
  const bool oscillates = mode.s.imag() != 0.0;
  switch (mode.stability) {
    case Stability::marginal:
      return oscillates ? "rings for ever" : "integrates";
    case Stability::stable:
      return std::isinf(mode.s.real()) ? "is gone after one sample"
             : oscillates              ? "decays ringing"
                                       : "decays";
    case Stability::unstable:
      return oscillates ? "grows ringing" : "grows";
  }
  return {};
}

Tone tone_of(Stability stability) {
  return stability == Stability::unstable   ? Tone::bad
         : stability == Stability::marginal ? Tone::caution
                                            : Tone::plain;
}

Section poles_section(const ModelAnalysis& result) {
  const bool continuous = is_continuous(result);
  const bool sampled = result.sampled.has_value();
  Section section{"poles", "Poles", {}};
  Table table;
  table.header = {continuous ? "pole s (rad/s)" : "pole z"};
  if (sampled) {
    table.header.push_back("sampled: z");
  }
  table.header.insert(table.header.end(),
                      {"time constant", "frequency (rad/s)", "damping", "what it does"});
  table.wide_column = table.header.size() - 1;
  std::size_t left_out = 0;
  for (const Mode& mode : result.modes.modes) {
    if (mode.pole.imag() < 0.0) {
      continue;  // shown with its conjugate
    }
    if (table.rows.size() == most_rows) {
      ++left_out;
      continue;
    }
    std::vector<Value> row{complex_number(mode.pole)};
    if (sampled) {
      row.emplace_back(complex_number(std::exp(mode.pole * result.model.period->si())));
    }
    const bool moves = mode.stability != Stability::marginal && std::isfinite(mode.s.real());
    row.emplace_back(moves ? seconds(std::abs(mode.time_constant)) : "");
    row.emplace_back(std::isfinite(mode.natural_frequency) && mode.natural_frequency > 0.0
                         ? number(mode.natural_frequency)
                         : "");
    row.emplace_back(mode.s.imag() != 0.0 ? number(mode.damping_ratio, 3) : "");
    row.emplace_back(behaviour(mode), tone_of(mode.stability));
    table.rows.push_back(std::move(row));
  }
  section.blocks.emplace_back(std::move(table));
  if (left_out > 0) {
    section.blocks.emplace_back(
        Paragraph{fmt::format("… and {}, all faster; --json has them.", count(left_out, "pole")),
                  Tone::quiet});
  }
  return section;
}

/// The states that make up most of a mode.
std::string owners(const ModeReach& mode, const std::vector<std::string>& states) {
  constexpr double large_share = 0.25;
  std::vector<std::string> names;
  for (Eigen::Index k = 0; k < mode.participation.size(); ++k) {
    if (mode.participation(k) >= large_share) {
      names.push_back(states[static_cast<std::size_t>(k)]);
    }
  }
  return names.empty() ? "all states together" : enumerate(names);
}

/// The verdict and the hidden states, in the words of `describe`, and a table of the modes.
void add_reach(Section& section, const ReachAnalysis& analysis, const std::string& words, Tone tone,
               const std::vector<std::string>& states) {
  bool first = true;
  for (const std::string_view line : text::split(words, "\n")) {
    const bool of_a_mode = line.starts_with("mode ") || line.find(" the mode ") != line.npos;
    if (!of_a_mode) {
      section.blocks.emplace_back(Paragraph{capitalized(line) + ".", first ? tone : Tone::plain});
    }
    first = false;
  }
  Table table;
  table.header = {"mode", "distance", "mostly of"};
  table.wide_column = 2;
  for (const ModeReach& mode : analysis.modes) {
    if (mode.eigenvalue.imag() < 0.0) {
      continue;  // shown with its conjugate
    }
    if (table.rows.size() == most_rows) {
      section.blocks.emplace_back(Paragraph{"The nearest; --json has all.", Tone::quiet});
      break;
    }
    constexpr double weak = 1e-6;
    const Tone tone_of_mode = mode.reached && mode.distance >= weak ? Tone::plain
                              : mode.stability == Stability::stable ? Tone::caution
                                                                    : Tone::bad;
    table.rows.push_back({complex_number(mode.eigenvalue),
                          {mode.reached ? number(mode.distance, 2) : "out of reach", tone_of_mode},
                          owners(mode, states)});
  }
  section.blocks.emplace_back(std::move(table));
}

Section structure_section(const ModelAnalysis& result) {
  const std::vector<std::string> names = labels(result.model.states);
  const auto tone = [](bool all, bool enough) {
    return all ? Tone::good : enough ? Tone::caution : Tone::bad;
  };
  Section section{"structure", "What can be moved and seen", {}};
  const ControllabilityAnalysis& controllability = result.controllability;
  add_reach(section, controllability, describe(controllability, names),
            tone(controllability.controllable, controllability.stabilizable), names);
  const ObservabilityAnalysis& observability = result.observability;
  add_reach(section, observability, describe(observability, names),
            tone(observability.observable, observability.detectable), names);
  section.blocks.emplace_back(
      Paragraph{"The distance is the relative change of the matrices that could cut a mode off: "
                "0.01 is ordinary, 1e-8 all but out of reach.",
                Tone::quiet});
  return section;
}

/// What a constant input of one leads to.
std::string gain_at_rest(const ModelAnalysis& result) {
  if (!result.dc_gain) {
    return "infinite: a constant input is integrated";
  }
  const Eigen::MatrixXd& gain = *result.dc_gain;
  if (gain.cols() > 1 || gain.rows() > most_shown) {
    return shown(gain) + " (outputs x inputs)";
  }
  std::vector<std::string> parts;
  for (Eigen::Index i = 0; i < gain.rows(); ++i) {
    parts.push_back(fmt::format("{} in {}", number(gain(i, 0)),
                                label(result.model.outputs[static_cast<std::size_t>(i)])));
  }
  return fmt::format(
      "{}, for a constant one in {}{}", enumerate(parts), label(result.model.inputs[0]),
      result.modes.stability == Stability::unstable ? "; not reached, it is unstable" : "");
}

Section response_section(const ModelAnalysis& result) {
  Section section{"response", "Response", {}};
  Facts facts;
  facts.add("gain at rest", gain_at_rest(result));
  if (result.h_infinity_norm) {
    const HInfinityNorm& peak = *result.h_infinity_norm;
    facts.add(
        "largest gain",
        std::isinf(peak.frequency)
            ? fmt::format("{} towards infinite frequency (H∞ norm)", number(peak.norm))
            : fmt::format("{} at {} rad/s (H∞ norm)", number(peak.norm), number(peak.frequency)));
  }
  if (result.h2_norm) {
    facts.add("under white noise",
              fmt::format("standard deviation {} for a noise of one on each input (H2 norm)",
                          number(*result.h2_norm)));
  }
  section.blocks.emplace_back(std::move(facts));
  return section;
}

Section sampling_section(const ModelAnalysis& result) {
  const SampledAnalysis& sampled = *result.sampled;
  const SamplingAnalysis& sampling = sampled.sampling;
  Section section{
      "sampling", fmt::format("Sampled each {}", seconds(result.model.period->si())), {}};
  Facts facts;
  facts.add("A", shown(sampled.system.A));
  facts.add("B", shown(sampled.system.B));
  if (std::isfinite(sampling.samples_per_radian)) {
    facts.add("fastest pole",
              fmt::format("{} rad/s, {} samples in its time constant",
                          number(sampling.fastest_rate), number(sampling.samples_per_radian, 3)),
              sampling.samples_per_radian < 1.0 ? Tone::caution : Tone::plain);
  }
  facts.add("Nyquist frequency", quantity(sampling.nyquist_frequency, "rad/s"));
  section.blocks.emplace_back(std::move(facts));
  if (sampling.aliases) {
    section.blocks.emplace_back(
        Paragraph{"A mode oscillates faster than the samples can show: they mistake it for a "
                  "slower one.",
                  Tone::bad});
  }
  if (sampling.loses_controllability) {
    section.blocks.emplace_back(
        Paragraph{"Two modes look the same to the samples: with this period one input no longer "
                  "moves both. Another period does not have this.",
                  Tone::bad});
  }
  return section;
}

Verdict verdict_of(const ModelAnalysis& result) {
  Verdict verdict;
  const ControllabilityAnalysis& controllability = result.controllability;
  const ObservabilityAnalysis& observability = result.observability;
  if (result.modes.stability == Stability::unstable) {
    verdict.add(Tone::caution, "left alone, it runs away");
  } else if (result.modes.stability == Stability::marginal) {
    verdict.add(Tone::good, "left alone, it neither comes back to where it was nor runs away");
  }
  if (!controllability.stabilizable) {
    verdict.add(Tone::bad,
                "a mode that does not decay is moved by no input: no controller can make it "
                "stable");
  } else if (!controllability.controllable) {
    verdict.add(Tone::caution,
                "no input moves every mode, but those that none moves decay by themselves");
  }
  if (!observability.detectable) {
    verdict.add(Tone::bad,
                "a mode that does not decay is shown by no output: no observer can know the "
                "state");
  } else if (!observability.observable) {
    verdict.add(Tone::caution,
                "no output shows every mode, but those that none shows decay by themselves");
  }
  if (result.sampled &&
      (result.sampled->sampling.aliases || result.sampled->sampling.loses_controllability)) {
    verdict.add(Tone::caution, "the sample period is too long for it, see below");
  }
  verdict.line = capitalized(to_string(result.modes.stability));
  verdict.line += controllability.controllable && observability.observable
                      ? ", controllable and observable: every state can be moved and seen."
                  : controllability.stabilizable && observability.detectable
                      ? "; a controller and an observer can do without what is out of reach."
                      : "; no controller with these inputs and outputs can make it stable.";
  return verdict;
}

}  // namespace

Document document_of(const ModelAnalysis& result) {
  Document document;
  const ModelFile& model = result.model;
  document.title = title_of(model.plant           ? std::string(to_string(model.plant->kind))
                            : !model.name.empty() ? model.name
                                                  : "linear system",
                            "", model.path);
  document.verdict = verdict_of(result);
  document.sections = {system_section(result), poles_section(result), structure_section(result),
                       response_section(result)};
  if (model.point) {
    const ModelDescription names{.states = model.states, .inputs = model.inputs};
    document.sections.insert(document.sections.begin(), point_section(*model.point, names));
  }
  if (result.sampled) {
    document.sections.push_back(sampling_section(result));
  }
  if (!model.notes.empty()) {
    document.sections.push_back(diagnostics_section(model.notes));
  }
  document.origins.add("model", model.path);
  return document;
}

}  // namespace flyball::study
