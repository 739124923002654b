#include "solve/structure_answer.hpp"

namespace flyball::solve {

namespace {

void write_reach(const ReachAnalysis& analysis, const std::string& prefix, std::string_view hidden,
                 AnswerWriter& answer) {
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
  answer.add(prefix + "_rank", static_cast<double>(analysis.rank));
  answer.add(prefix + "_condition", analysis.matrix_condition);
  answer.add(prefix + "_modes", modes);
  answer.add_list(prefix + "_distances", distances);
}

}  // namespace

void write_structure(const StructureAnalysis& structure, std::span<const std::string> states,
                     AnswerWriter& answer) {
  answer.add("controllable", structure.controllability.controllable);
  answer.add("observable", structure.observability.observable);
  answer.add("stabilizable", structure.controllability.stabilizable);
  answer.add("detectable", structure.observability.detectable);
  answer.add_text("stability", to_string(structure.modes.stability));
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
  answer.add_list("damping_ratios", damping);
  answer.add_list("natural_frequencies", frequency);
  write_reach(structure.controllability, "controllability", "uncontrollable_modes", answer);
  write_reach(structure.observability, "observability", "unobservable_modes", answer);
  answer.add_text("words", describe(structure.controllability, states) + "\n" +
                               describe(structure.observability, states));
}

}  // namespace flyball::solve
