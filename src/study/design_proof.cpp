#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include <fmt/format.h>

#include <flyball/control/parameter_ellipsoid.hpp>

#include "core/try.hpp"
#include "study/design_steps.hpp"

// What holds of the loop for every mechanism of a set, with a proof.
namespace flyball::study {

namespace {

using Eigen::Index;

constexpr double error_share = 0.2;   ///< Of inertia and gain, as in the grid.
constexpr double delay_share = 0.25;  ///< Of a delay that is predicted over.
/// A proof's work grows with the sixth power of the states.
constexpr Index most_states = 14;
constexpr double most_work = 2e8;  ///< A tenth of a second, for each claim.

UncertainLoop uncertain_loop(const LoopDesign& loop, const DesignJob& job) {
  const auto& [model, K, K_e] = loop.regulator;
  const Index n = model.A.rows();
  // As `observer_regulator_loop`, whose plant is of the set.
  const Eigen::MatrixXd I_KC = Eigen::MatrixXd::Identity(n, n) - K_e * model.C;
  const Eigen::MatrixXd A_BK = model.A - model.B * K;
  const bool position = !controls_velocity(job.plant.kind);
  UncertainLoop uncertain{.plant = MechanismFamily{.position = position},
                          .C = Eigen::MatrixXd::Zero(1, position ? 2 : 1),
                          .period = model.period,
                          .A_c = A_BK * I_KC,
                          .B_c = A_BK * K_e,
                          .C_c = K * I_KC,
                          .D_c = K * K_e,
                          .set = {}};
  uncertain.C(0, 0) = 1.0;
  return uncertain;
}

/// How far a parameter reaches to either side of the centre.
double reach_of(const ParameterSet& set, Index parameter) {
  const auto row = set.axes.row(parameter);
  return row.head(set.round).norm() + row.tail(row.size() - set.round).cwiseAbs().sum();
}

Expected<PlantProof> proof_of(std::string of, std::string set, const UncertainLoop& loop) {
  PlantProof proof{.of = std::move(of), .set = std::move(set)};
  const Index last = loop.set.centre.size() - 1;
  const double delay = loop.set.centre(last) + reach_of(loop.set, last);
  proof.states = static_cast<int>(loop.C.cols() + loop.A_c.rows()) +
                 static_cast<int>(std::ceil(delay / loop.period.si() - 1e-9));
  proof.tried = proof.states <= most_states;
  if (!proof.tried) {
    return proof;
  }
  FLYBALL_TRY(proof.certificate, certify_loop(loop, {.most_pieces = 2000, .most_work = most_work}));
  if (std::get<MechanismFamily>(loop.plant).logarithmic) {
    for (LoopMember* member : {&proof.certificate.worst, &proof.certificate.slowest}) {
      if (member->parameters.size() > 1) {
        member->parameters(1) = std::exp(member->parameters(1));
      }
    }
  }
  return proof;
}

/// The joint 95 % set of kV, ln kA and, where it is not said, the delay.
Expected<ParameterSet> confidence_set(const PlantSpread& spread, const PlantDescription& plant,
                                      double delay) {
  const double kV = plant.gains.kV;
  const std::vector<double> estimate{kV, std::log(plant.gains.kA), 1.0, delay};
  Eigen::MatrixXd covariance = Eigen::MatrixXd::Zero(4, 4);
  const std::array<Index, 3> places{0, 1, 3};
  const Eigen::Vector3d units(kV, 1.0, 1.0);
  for (Index i = 0; i < 3; ++i) {
    for (Index j = 0; j < 3; ++j) {
      covariance(places[static_cast<std::size_t>(i)], places[static_cast<std::size_t>(j)]) =
          units(i) * spread.covariance(i, j) * units(j);
    }
  }
  return parameter_ellipsoid(estimate, estimate, covariance);
}

}  // namespace

Expected<std::vector<PlantProof>> proofs_of(const LoopDesign& loop, const DesignJob& job) {
  const PlantDescription& plant = job.plant;
  const double kV = plant.gains.kV;
  const double delay = job.controller.delay.value_or(0.0);
  UncertainLoop uncertain = uncertain_loop(loop, job);
  std::vector<PlantProof> proofs;

  const double kA_low = plant.kA_determined ? (1.0 - error_share) * plant.gains.kA : 0.0;
  const double kA_high =
      plant.kA_determined ? (1.0 + error_share) * plant.gains.kA : plant.kA_upper_bound;
  FLYBALL_TRY(uncertain.set, parameter_box({kV, kA_low, 1.0 - error_share, delay},
                                           {kV, kA_high, 1.0 + error_share, delay}));
  FLYBALL_TRY(
      auto errors,
      proof_of("errors",
               plant.kA_determined ? std::string("an inertia and a gain within ±20 % of the "
                                                 "model's")
               : kA_high > 0.0
                   ? fmt::format("a kA from 0 to {} V·s²/{} and a gain within ±20 % of the "
                                 "model's",
                                 format_number(kA_high, 3), plant.unit)
                   : std::string("no inertia and a gain within ±20 % of the model's"),
               uncertain));
  proofs.push_back(std::move(errors));

  if (loop.predicts && plant.kA_determined) {
    FLYBALL_TRY(uncertain.set,
                parameter_box({kV, plant.gains.kA, 1.0, (1.0 - delay_share) * delay},
                              {kV, plant.gains.kA, 1.0, (1.0 + delay_share) * delay}));
    FLYBALL_TRY(
        auto delays,
        proof_of("delays", "a delay within ±25 % of what it was predicted over", uncertain));
    proofs.push_back(std::move(delays));
  }
  if (plant.spread && plant.kA_determined) {
    std::get<MechanismFamily>(uncertain.plant).logarithmic = true;
    PlantSpread spread = *plant.spread;
    FLYBALL_TRY(uncertain.set, confidence_set(spread, plant, delay));
    const bool delays = spread.covariance(2, 2) > 0.0;
    FLYBALL_TRY(auto identified,
                proof_of("identified",
                         delays ? "a kV, a kA and a delay of the log's joint 95 % set"
                                : "a kV and a kA of the log's joint 95 % set",
                         uncertain));
    if (delays && identified.certificate.verdict == LoopVerdict::undecided) {
      // A delay that a log leaves wide open is more than the work suffices for: what is shown then
      // is of the delay that the loop is designed for.
      spread.covariance.row(2).setZero();
      spread.covariance.col(2).setZero();
      FLYBALL_TRY(uncertain.set, confidence_set(spread, plant, delay));
      FLYBALL_TRY(auto nearer,
                  proof_of("identified", "a kV and a kA of the log's joint 95 % set", uncertain));
      if (nearer.tried && nearer.certificate.verdict != LoopVerdict::undecided) {
        identified = std::move(nearer);
      }
    }
    proofs.push_back(std::move(identified));
  }
  return proofs;
}

}  // namespace flyball::study
