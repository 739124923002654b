#include <algorithm>
#include <cmath>

#include <fmt/format.h>

#include <flyball/control/lyapunov/region_plot.hpp>
#include <flyball/export/swing_up.hpp>

#include "study/answer/model_parts.hpp"

namespace flyball::study {

namespace {

using text::number;

constexpr double hysteresis = 1.5;

std::string_view limit_words(AttractionLimit limit) {
  switch (limit) {
    case AttractionLimit::rate:
      return "beyond it V = (x − x*)ᵀP(x − x*) does not fall everywhere";
    case AttractionLimit::reach:
      return "the reach, or half a turn";
    case AttractionLimit::work:
      return "the work that is allowed for the proof";
  }
  return "";
}

Section region_section(const ModelDesign& result) {
  const ModelRegion& region = *result.region;
  const CertifiedRegion& certified = region.certified;
  Section section{"region", "Region of attraction", {}};
  Facts facts;
  facts.add("proven", fmt::format("V ≤ {}", number(certified.level)), Tone::good);
  const auto& states = result.job.model.names().states;
  for (std::size_t i = 0; i < states.size(); ++i) {
    facts.add(fmt::format("reaches in {}", states[i].name),
              quantity(certified.extent(static_cast<Eigen::Index>(i)), states[i].unit, 3));
  }
  facts.add("its end", std::string(limit_words(certified.limit)));
  if (!region.sampled.comes.empty()) {
    facts.add("of what comes to rest in the plane shown, simulated, the proof misses",
              text::percent(region.sampled.missed(), 2));
  }
  section.blocks.emplace_back(std::move(facts));
  section.blocks.emplace_back(Paragraph{
      "From every state with V up to there the loop comes to the point, its inputs at "
      "their limits or "
      "not: proven for the model as it is written, its state known, and an input that acts at all "
      "times.",
      Tone::quiet});
  return section;
}

/// The way of the swing-up through the plane, angles brought near the point.
PlotLine path_of(const ModelDesign& result) {
  const ModelRegion& region = *result.region;
  const SwingUpRunResult& run = *result.swing_up;
  PlotLine line{.label = "swing-up", .style = LineStyle::solid};
  const auto& states = run.simulation.states;
  const auto column = [&](Eigen::Index state) {
    return run.simulation.series.find(states[static_cast<std::size_t>(state)].truth);
  };
  const std::vector<double>* const x = column(region.first);
  const std::vector<double>* const y = column(region.second);
  if (x == nullptr || y == nullptr) {
    return line;
  }
  constexpr std::size_t most_points = 4000;
  const std::size_t stride = x->size() / most_points + 1;
  for (std::size_t i = 0; i < x->size(); i += stride) {
    line.x.push_back((*x)[i]);
    line.y.push_back((*y)[i]);
  }
  return line;
}

std::vector<Figure> region_figures(const ModelDesign& result) {
  const ModelRegion& region = *result.region;
  if (result.job.model.states() < 2) {
    return {};
  }
  const auto& states = result.job.model.names().states;
  auto plot = region_plot(region.loop, region.certified, states, region.first, region.second,
                          &region.sampled, {0.25, 0.5});
  if (!plot) {
    return {};
  }
  if (result.swing_up) {
    plot->panels[0].lines.push_back(path_of(result));
  }
  plot->width = 640;
  const auto name = [&](Eigen::Index i) { return states[static_cast<std::size_t>(i)].name; };
  return {
      {"region", "region_of_attraction", plot->title,
       fmt::format("The proven region in the plane of {} and {}, the other states at the point, "
                   "and starts of the plane that come to rest, simulated, whatever the reach.",
                   name(region.first), name(region.second)),
       *std::move(plot)}};
}

exports::SwingUpProgram program_of(const ModelDesign& result) {
  const SwingUpRunResult& run = *result.swing_up;
  const ModelRegion& region = *result.region;
  exports::SwingUpProgram program{.origin = result.job.model.names().name,
                                  .x = region.loop.x,
                                  .u = region.loop.u(0),
                                  .limit = result.job.limit(0),
                                  .K = region.loop.K,
                                  .P = region.certified.P,
                                  .level = region.certified.level,
                                  .leave = hysteresis * region.certified.level,
                                  .law = run.law,
                                  .parameters = run.parameters,
                                  .energy = run.energy,
                                  .scale = run.scale,
                                  .sharpness = result.job.swing_up.sharpness,
                                  .hold = result.job.swing_up.hold};
  for (const Coordinate& state : result.job.model.names().states) {
    program.states.push_back(label(state));
    program.angles.push_back(state.is_angle);
  }
  return program;
}

Section swing_up_section(const ModelDesign& result) {
  const SwingUpRunResult& run = *result.swing_up;
  Section section{"swing_up", "Swing-up", {}};
  Facts facts;
  facts.add("energy at the point",
            fmt::format("{} (± {} over the angles)", number(run.energy), number(run.scale)));
  facts.add("the regulator takes over after",
            run.taken ? Value(text::seconds(*run.taken)) : Value("not within the run", Tone::bad));
  facts.add("it stands after", run.stands ? Value(text::seconds(*run.stands), Tone::good)
                                          : Value("not within the run", Tone::bad));
  facts.add("the controller in C++17", "swing_up.hpp, with --out");
  section.blocks.emplace_back(std::move(facts));
  return section;
}

std::vector<Figure> swing_up_figures(const ModelDesign& result) {
  std::vector<Figure> figures = figures_of(result.swing_up->simulation);
  std::erase_if(figures, [](const Figure& figure) { return figure.name == "phase_plane"; });
  for (Figure& figure : figures) {
    figure.section = "swing_up";
    figure.name = "swing_up_" + figure.name;
    figure.title += " of the swing-up";
    figure.plot.title = figure.title;
    figure.plot.clock = "swing_up";
  }
  return figures;
}

}  // namespace

void append_region(const ModelDesign& result, Answer& answer) {
  if (!result.region) {
    return;
  }
  auto& sections = answer.document.sections;
  const auto diagnostics =
      std::find_if(sections.begin(), sections.end(),
                   [](const Section& section) { return section.id == "diagnostics"; });
  std::vector<Section> made{region_section(result)};
  append(answer.figures, region_figures(result));
  if (result.swing_up) {
    made.push_back(swing_up_section(result));
    append(answer.figures, swing_up_figures(result));
    if (!result.swing_up->stands) {
      answer.document.verdict.add(Tone::caution,
                                  "the swing-up does not stand at the end of its run: look at "
                                  "simulation.duration, controller.limit, swing_up.hold and the "
                                  "signs and factors of swing_up.energy");
    }
    AnswerFile data = data_file(result.swing_up->simulation);
    data.name = "data/swing_up.csv";
    answer.files.push_back(std::move(data));
    if (auto header = exports::swing_up_header(program_of(result))) {
      answer.files.push_back({"swing_up.hpp", *std::move(header)});
    }
  }
  sections.insert(diagnostics, std::make_move_iterator(made.begin()),
                  std::make_move_iterator(made.end()));
}

void write_region(JsonWriter& json, const ModelDesign& result) {
  if (result.region) {
    json.object("region", [&] {
      const CertifiedRegion& certified = result.region->certified;
      json.add("P", certified.P);
      json.add("level", certified.level);
      json.add("extent", [&] {
        Eigen::VectorXd extent(certified.x.size());
        for (Eigen::Index i = 0; i < extent.size(); ++i) {
          extent(i) = certified.extent(i);
        }
        return extent;
      }());
      json.add("limit", certified.limit == AttractionLimit::rate    ? "rate"
                        : certified.limit == AttractionLimit::reach ? "reach"
                                                                    : "work");
      json.add("missed", result.region->sampled.missed());
    });
  }
  if (result.swing_up) {
    const SwingUpRunResult& run = *result.swing_up;
    json.object("swing_up", [&] {
      json.add("energy", run.energy);
      json.add("energy_scale", run.scale);
      json.add("start", run.start);
      json.add("taken", run.taken.value_or(std::nan("")));
      json.add("stands", run.stands.value_or(std::nan("")));
      json.object("simulation", [&] { write_simulation(json, run.simulation); });
    });
  }
}

}  // namespace flyball::study
