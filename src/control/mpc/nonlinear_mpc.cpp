#include <flyball/control/mpc/nonlinear_mpc.hpp>

#include <algorithm>
#include <cmath>
#include <string>

#include <flyball/math/expression/lagrangian.hpp>

#include "control/mpc/mpc_limits.hpp"
#include "control/mpc/mpc_parts.hpp"
#include "core/try.hpp"

namespace flyball::detail {

using Eigen::Index;
using Eigen::MatrixXd;
using expression::LaneTape;
using expression::Slot;
using expression::TapeBuilder;

namespace {

constexpr int first_iterations = 10;
constexpr ButcherTableau<4> runge_kutta_4{
    .A = {{{0.0, 0.0, 0.0, 0.0}, {0.5, 0.0, 0.0, 0.0}, {0.0, 0.5, 0.0, 0.0}, {0.0, 0.0, 1.0, 0.0}}},
    .b = {1.0 / 6.0, 1.0 / 3.0, 1.0 / 3.0, 1.0 / 6.0},
    .c = {0.0, 0.5, 0.5, 1.0},
    .order = 4};

}  // namespace

StepTape::StepTape(const ModelTape& model, double period) {
  const auto variables = static_cast<std::size_t>(model.states + model.inputs);
  const expression::Lagrangian step = expression::runge_kutta_step(
      expression::lagrangian(model.f, variables), runge_kutta_4, period);
  // The step and its Jacobian; Hessians, whose weights are no inputs here, fall away.
  TapeBuilder builder(variables, step.tape.parameters());
  std::vector<Slot> in;
  for (std::size_t i = 0; i < variables; ++i) {
    in.push_back(builder.input(i));
  }
  in.resize(variables + step.rows, builder.constant(0.0));
  std::vector<Slot> parameters;
  for (std::size_t i = 0; i < step.tape.parameters(); ++i) {
    parameters.push_back(builder.parameter(i));
  }
  std::vector<Slot> out = expression::replay(builder, step.tape, in, parameters);
  out.resize(step.rows + step.jacobian.size());
  tape = LaneTape(builder.finish(out));
  entries = step.jacobian;
  work.assign(tape.workspace_size(), 0.0);
  tape.prepare(model.parameters, work.data());
}

Expected<MpcCore> MpcCore::make(const ModelTape& model, Time period, const MatrixRef& Q,
                                const MatrixRef& R, const MpcSettings& settings) {
  constexpr std::string_view where = "nonlinear_mpc";
  FLYBALL_CHECK(check_positive(period.si(), where, "period", "s"));
  if (model.states < 1 || model.inputs < 1) {
    return refusal(ArgumentError::empty, where,
                   model.states < 1 ? "the model's state" : "the model's input")
        .got("empty")
        .expected("of one number at least");
  }
  FLYBALL_TRY(MpcSettings complete,
              complete_settings(settings, model.states, model.inputs, Q, R, where,
                                [&] { return Expected<MatrixXd>(MatrixXd(Q)); }));
  optimization::detail::StageQpSizes sizes = sizes_of(complete, model.states, model.inputs);
  sizes.stays = false;
  auto parts = std::make_unique<Parts>(static_cast<int>(model.states),
                                       static_cast<int>(model.inputs), Q, R, complete, sizes);
  const int N = complete.horizon;
  parts->fill_cost(N);
  if (!parts->finish()) {
    return refusal(ArgumentError::not_positive, where, "the cost over the horizon")
        .got("not convex")
        .expected("of Q and R whose sizes can be added");
  }
  auto step = std::make_shared<StepTape>(model, period.si());
  parts->work = step->work;
  parts->model = std::move(step);
  parts->x_bar.setZero(model.states, N + 1);
  parts->u_bar.setZero(model.inputs, N);
  return MpcCore(std::move(parts));
}

bool MpcCore::Parts::linearize() noexcept {
  const LaneTape& tape = model->tape;
  const int N = settings.horizon;
  const int width = qp.width();
  constexpr int lanes = static_cast<int>(LaneTape::lanes);
  double check = 0.0;
  for (int first = 0; first < N; first += lanes) {
    double* const to = tape.input(0, work.data());
    const int count = std::min(lanes, N - first);
    for (int l = 0; l < lanes; ++l) {
      const int k = first + std::min(l, count - 1);
      for (int i = 0; i < n; ++i) {
        to[i * lanes + l] = x_bar(i, k);
      }
      for (int j = 0; j < m; ++j) {
        to[(n + j) * lanes + l] = u_bar(j, k);
      }
    }
    tape.evaluate(work.data());
    for (int i = 0; i < n; ++i) {
      const double* const y = tape.output(static_cast<std::size_t>(i), work.data());
      for (int l = 0; l < count; ++l) {
        qp.b(first + l)[i] = y[l];
        check += y[l];
      }
    }
    for (std::size_t e = 0; e < model->entries.size(); ++e) {
      const double* const y = tape.output(static_cast<std::size_t>(n) + e, work.data());
      const int row = static_cast<int>(model->entries[e].row);
      const int column = static_cast<int>(model->entries[e].column);
      const int place = column < n ? column : column + rates;
      for (int l = 0; l < count; ++l) {
        const int k = first + l;
        qp.AB(k)[row * width + place] = y[l];
        qp.b(k)[row] -= y[l] * (column < n ? x_bar(column, k) : u_bar(column - n, k));
        check += y[l];
      }
    }
  }
  for (int k = 0; k < N; ++k) {
    qp.transpose(k);
  }
  return std::isfinite(check);
}

void MpcCore::Parts::follow(bool moved) noexcept {
  const int N = settings.horizon;
  const int by = moved && N > 1 ? 1 : 0;
  for (int k = 0; k <= N; ++k) {
    std::copy_n(qp.z(std::min(k + by, N)), n, x_bar.col(k).data());
    if (k < N) {
      std::copy_n(qp.z(std::min(k + by, N - 1)) + n + rates, m, u_bar.col(k).data());
    }
  }
}

MpcStatus MpcCore::Parts::iterate(const double* x) noexcept {
  const int N = settings.horizon;
  const bool is_first = !has_trajectory;
  if (is_first) {
    for (int k = 0; k <= N; ++k) {
      std::copy_n(x, n, x_bar.col(k).data());
      if (k < N) {
        for (int j = 0; j < m; ++j) {
          u_bar(j, k) = std::clamp(input_reference(k * m + j), qp.lower(0)[j], qp.upper(0)[j]);
        }
      }
    }
  } else {
    follow(true);
  }
  has_trajectory = false;
  MpcStatus status = MpcStatus::held;
  for (int round = 0; round < (is_first ? first_iterations : 1); ++round) {
    std::copy_n(x, n, x_bar.col(0).data());
    if (!linearize()) {
      return MpcStatus::held;
    }
    qp.qp().has_affine = true;
    status = solve(x);
    if (status == MpcStatus::held) {
      return status;
    }
    change = 0.0;
    for (int k = 0; k < N; ++k) {
      for (int j = 0; j < m; ++j) {
        change = std::max(change, std::abs(qp.z(k)[n + rates + j] - u_bar(j, k)));
      }
    }
    follow(false);
  }
  has_trajectory = true;
  return status;
}

}  // namespace flyball::detail
