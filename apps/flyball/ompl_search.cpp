#include <memory>
#include <utility>
#include <vector>

#include <fmt/format.h>

#include <flyball/core/argument.hpp>

#include "ompl_search.hpp"

#ifdef FLYBALL_HAS_OMPL
#include <ompl/base/MotionValidator.h>
#include <ompl/base/SpaceInformation.h>
#include <ompl/base/spaces/RealVectorStateSpace.h>
#include <ompl/base/spaces/SO2StateSpace.h>
#include <ompl/geometric/SimpleSetup.h>
#include <ompl/geometric/planners/rrt/RRTConnect.h>
#include <ompl/util/Console.h>
#include <ompl/util/RandomNumbers.h>
#endif

namespace flyball::app {

#ifdef FLYBALL_HAS_OMPL

namespace {

namespace ob = ompl::base;

/// A subspace an axis: angles that wrap are circles.
std::shared_ptr<ob::CompoundStateSpace> states_of(const ConfigurationSpace& space) {
  auto states = std::make_shared<ob::CompoundStateSpace>();
  for (const SpaceAxis& axis : space.axes()) {
    if (axis.wraps) {
      states->addSubspace(std::make_shared<ob::SO2StateSpace>(), 1.0 / axis.scale);
    } else {
      auto line = std::make_shared<ob::RealVectorStateSpace>(1);
      line->setBounds(axis.low, axis.high);
      states->addSubspace(line, 1.0 / axis.scale);
    }
  }
  return states;
}

std::vector<double> values_of(const ConfigurationSpace& space, const ob::State* state) {
  std::vector<double> q;
  for (std::size_t k = 0; k < space.axes().size(); ++k) {
    const ob::State* part = state->as<ob::CompoundState>()->components[k];
    q.push_back(space.axes()[k].wraps ? part->as<ob::SO2StateSpace::StateType>()->value
                                      : part->as<ob::RealVectorStateSpace::StateType>()->values[0]);
  }
  return q;
}

void put(const ConfigurationSpace& space, std::span<const double> q,
         const std::shared_ptr<ob::CompoundStateSpace>& states, ob::State* state) {
  for (std::size_t k = 0; k < q.size(); ++k) {
    ob::State* part = state->as<ob::CompoundState>()->components[k];
    if (space.axes()[k].wraps) {
      part->as<ob::SO2StateSpace::StateType>()->value = q[k];
    } else {
      part->as<ob::RealVectorStateSpace::StateType>()->values[0] = q[k];
    }
  }
  states->enforceBounds(state);  // of an angle its turn
}

/// Moves along their whole length, in place of samples.
class WholeMoves final : public ob::MotionValidator {
 public:
  WholeMoves(const ob::SpaceInformationPtr& information, const ConfigurationSpace& space)
      : ob::MotionValidator(information), space_(space) {}

  bool checkMotion(const ob::State* from, const ob::State* to) const override {
    const std::vector<double> q = values_of(space_, from);
    const bool free = space_.check_move(q, space_.difference(q, values_of(space_, to))).free;
    ++(free ? valid_ : invalid_);
    return free;
  }
  bool checkMotion(const ob::State* from, const ob::State* to,
                   std::pair<ob::State*, double>& last) const override {
    const bool free = checkMotion(from, to);
    if (!free) {
      if (last.first != nullptr) {
        si_->copyState(last.first, from);
      }
      last.second = 0.0;
    }
    return free;
  }
  [[nodiscard]] long judged() const { return static_cast<long>(valid_) + invalid_; }

 private:
  const ConfigurationSpace& space_;
};

}  // namespace

Expected<ConfigurationPath> plan_by_ompl(const ConfigurationSpace& space,
                                         std::span<const double> start,
                                         std::span<const double> goal, const PathSearch& search) {
  ompl::msg::setLogLevel(ompl::msg::LOG_ERROR);
  ompl::RNG::setSeed(static_cast<std::uint_fast32_t>(search.seed + 1));  // it takes no 0
  const auto states = states_of(space);
  ompl::geometric::SimpleSetup setup(states);
  const auto& information = setup.getSpaceInformation();
  setup.setStateValidityChecker(
      [&](const ob::State* state) { return space.valid(values_of(space, state)); });
  const auto moves = std::make_shared<WholeMoves>(information, space);
  information->setMotionValidator(moves);
  ob::ScopedState<ob::CompoundStateSpace> from(states);
  ob::ScopedState<ob::CompoundStateSpace> to(states);
  put(space, start, states, from.get());
  put(space, goal, states, to.get());
  setup.setStartAndGoalStates(from, to);
  setup.setPlanner(std::make_shared<ompl::geometric::RRTConnect>(information));
  setup.setup();
  const bool solved = setup.solve(search.seconds) == ob::PlannerStatus::EXACT_SOLUTION;
  ob::PlannerData data(information);
  setup.getPlannerData(data);
  ConfigurationPath path{.method = PathMethod::rrt_connect,
                         .nodes = static_cast<long>(data.numVertices())};
  if (solved && search.shorten) {
    setup.simplifySolution(search.seconds);
  }
  bool whole = solved;
  std::vector<double> q(start.begin(), start.end());
  const std::size_t count = solved ? setup.getSolutionPath().getStateCount() : 0;
  for (std::size_t i = 0; i < count; ++i) {
    const std::vector<double> next =
        i + 1 == count
            ? std::vector<double>(goal.begin(), goal.end())
            : values_of(space, setup.getSolutionPath().getState(static_cast<unsigned>(i)));
    const std::vector<double> by = space.difference(q, next);
    whole = whole && space.check_move(q, by).free;
    for (std::size_t k = 0; k < q.size(); ++k) {
      q[k] += by[k];
    }
    if (i == 0 || space.length(by) > 0.0) {
      path.waypoints.push_back(q);
      path.length += space.length(by);
    }
  }
  path.moves = moves->judged();
  if (!whole) {
    return tl::unexpected(
        Error(ConfigurationError::undecided)
            .in("plan")
            .about("OMPL's RRT-Connect")
            .got(fmt::format("without a path after {} s: {} moves judged, {} nodes in its trees",
                             format_number(search.seconds), path.moves, path.nodes))
            .hint("raise --seconds, or leave --method out: boxes may prove that there is none"));
  }
  return path;
}

#else

Expected<ConfigurationPath> plan_by_ompl(const ConfigurationSpace& /*space*/,
                                         std::span<const double> /*start*/,
                                         std::span<const double> /*goal*/,
                                         const PathSearch& /*search*/) {
  return tl::unexpected(Error(ArgumentError::out_of_range)
                            .in("plan")
                            .about("the method ompl")
                            .got("not in this build")
                            .expected("one of Flyball's own")
                            .hint("install OMPL (Debian: libompl-dev) and configure again"));
}

#endif

}  // namespace flyball::app
