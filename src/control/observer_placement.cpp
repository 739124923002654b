#include <flyball/control/observer_placement.hpp>

#include <utility>

#include <flyball/estimation/observer.hpp>

#include "core/try.hpp"

namespace flyball {

namespace {

constexpr std::string_view in_place_observer = "place_observer";

/// The dual's refusal in words of the observer.
Error observer_error(const Error& dual) {
  if (!dual.is(PolePlacementError::not_controllable)) {
    return Error(dual).in(std::string(in_place_observer));
  }
  Error error = Error(PolePlacementError::not_observable)
                    .in(std::string(in_place_observer))
                    .about("(A, C)")
                    .hint("keep this mode among the poles, or measure what shows it");
  for (const Evidence& evidence : dual.evidence()) {
    error = evidence.text.empty() ? Error(std::move(error).with(evidence.name, evidence.values))
                                  : Error(std::move(error).with(evidence.name, evidence.text));
  }
  return error;
}

template <class System>
Expected<ObserverPlacement> placed(const System& plant, const Eigen::VectorXcd& poles) {
  FLYBALL_CHECK(check_system(plant, in_place_observer));
  auto dual = place(MatrixRef(plant.A.transpose()), MatrixRef(plant.C.transpose()), poles);
  if (!dual) {
    return tl::unexpected(observer_error(dual.error()));
  }
  return ObserverPlacement{.L = dual->K.transpose(),
                           .K = {},
                           .poles = dual->poles,
                           .condition = dual->condition,
                           .pole_error = dual->pole_error,
                           .unobservable = dual->uncontrollable};
}

}  // namespace

Expected<ObserverPlacement> place_observer(const DiscreteSystem<>& plant,
                                           const Eigen::VectorXcd& poles) {
  FLYBALL_TRY(auto observer, placed(plant, poles));
  if (auto K = filter_gain(plant.A, observer.L)) {
    observer.K = std::move(*K);
  }
  return observer;
}

Expected<ObserverPlacement> place_observer(const ContinuousSystem<>& plant,
                                           const Eigen::VectorXcd& poles) {
  return placed(plant, poles);
}

}  // namespace flyball
