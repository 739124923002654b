#include "solve/structure_answer.hpp"

namespace flyball::solve {

namespace {

void write_reach(const ReachAnalysis& analysis, const std::string& prefix, std::string_view hidden,
                 JsonWriter& answer) {
  std::vector<std::complex<double>> hidden_modes;
  Eigen::VectorXd distances(static_cast<Eigen::Index>(analysis.modes.size()));
  Eigen::VectorXcd modes(distances.size());
  for (Eigen::Index k = 0; k < distances.size(); ++k) {
    const ModeReach& mode = analysis.modes[static_cast<std::size_t>(k)];
    distances(k) = mode.distance;
    modes(k) = mode.eigenvalue;
    if (!mode.reached) {
      hidden_modes.push_back(mode.eigenvalue);
    }
  }
  answer.add(hidden, Eigen::VectorXcd(Eigen::Map<const Eigen::VectorXcd>(
                         hidden_modes.data(), static_cast<Eigen::Index>(hidden_modes.size()))));
  answer.add(prefix + "_rank", analysis.rank);
  answer.add(prefix + "_condition", analysis.matrix_condition);
  answer.add(prefix + "_modes", modes);
  answer.add(prefix + "_distances", distances);
}

}  // namespace

void write_structure(const StructureAnalysis& structure, std::span<const std::string> states,
                     JsonWriter& answer) {
  answer.add("controllable", structure.controllability.controllable);
  answer.add("observable", structure.observability.observable);
  answer.add("stabilizable", structure.controllability.stabilizable);
  answer.add("detectable", structure.observability.detectable);
  answer.add("stability", to_string(structure.modes.stability));
  const std::vector<Mode>& modes = structure.modes.modes;
  Eigen::VectorXcd poles(static_cast<Eigen::Index>(modes.size()));
  Eigen::VectorXd damping(poles.size());
  Eigen::VectorXd frequency(poles.size());
  for (Eigen::Index k = 0; k < poles.size(); ++k) {
    const Mode& mode = modes[static_cast<std::size_t>(k)];
    poles(k) = mode.pole;
    damping(k) = mode.damping_ratio;
    frequency(k) = mode.natural_frequency;
  }
  answer.add("poles", poles);
  answer.add("damping_ratios", damping);
  answer.add("natural_frequencies", frequency);
  write_reach(structure.controllability, "controllability", "uncontrollable_modes", answer);
  write_reach(structure.observability, "observability", "unobservable_modes", answer);
  answer.add("words", describe(structure.controllability, states) + "\n" +
                          describe(structure.observability, states));
}

std::vector<Field> structure_fields() {
  const auto reach = [](std::string_view hidden, std::string_view hidden_help,
                        std::string_view rank, std::string_view condition, std::string_view modes,
                        std::string_view distances) {
    return std::vector{
        complex_list(hidden, "h", hidden_help), integer(rank, "how many dimensions that is"),
        unbounded(number(condition, "",
                         "condition of the book's matrix (6.37 or 6.41), in the given units")),
        complex_list(modes, "n", "every mode, the hidden ones first, then by increasing distance"),
        unbounded(
            list(distances, "n", "",
                 "the relative change of the matrices that would cut off each of these modes"))};
  };
  return std::vector{flag("controllable", "whether the inputs move every mode"),
                     flag("observable", "whether the outputs show every mode"),
                     flag("stabilizable", "whether every mode that no input moves decays"),
                     flag("detectable", "whether every mode that no output shows decays"),
                     text("stability", "\"stable\", \"marginally stable\" or \"unstable\""),
                     complex_list("poles", "n", "the slowest or most unstable first"),
                     unbounded(list("damping_ratios", "n", "", "of these poles")),
                     unbounded(list("natural_frequencies", "n", "rad/s", "of these poles"))} +
         reach("uncontrollable_modes", "modes that no input moves", "controllability_rank",
               "controllability_condition", "controllability_modes", "controllability_distances") +
         reach("unobservable_modes", "modes that no output shows", "observability_rank",
               "observability_condition", "observability_modes", "observability_distances") +
         std::vector{text("words", "all of it for people")};
}

}  // namespace flyball::solve
