#include <algorithm>
#include <optional>
#include <utility>
#include <vector>

#include <flyball/math/regression/streamed_least_squares.hpp>

#include "identification/polynomials.hpp"

namespace flyball::identification {

using Eigen::Index;
using Eigen::VectorXd;

namespace {

/// Rows of shifted signals, solved for the target: signal k - lag for each lag.
struct Lagged {
  const VectorXd* signal;
  Index first_lag;
  Index count;
  double sign;
};
std::optional<VectorXd> regress(const std::vector<Lagged>& columns, const VectorXd& target,
                                Index first) {
  Index d = 0;
  for (const Lagged& part : columns) {
    d += part.count;
  }
  if (d == 0) {
    return VectorXd(0);
  }
  auto stream = StreamedLeastSquares::create(d);
  VectorXd row(d);
  for (Index k = first; stream && k < target.size(); ++k) {
    Index at = 0;
    for (const Lagged& part : columns) {
      for (Index i = 0; i < part.count; ++i) {
        const Index when = k - part.first_lag - i;
        row(at++) = when >= 0 ? part.sign * (*part.signal)(when) : 0.0;
      }
    }
    stream->add(row.data(), target(k));
  }
  const auto found = stream ? stream->solve() : tl::unexpected(stream.error());
  return found ? std::optional(found->coefficients) : std::nullopt;
}

/// Where the search begins: parameters by linear regressions, several of them.
class Starts {
 public:
  Starts(const ScaledRecord& record, const PolynomialOrders& orders)
      : record_(record), orders_(orders), inputs_(record.u.cols()), first_(start_of(orders)) {
    for (Index j = 0; j < inputs_; ++j) {
      u_.emplace_back(record.u.col(j));
    }
  }

  /// In families, each of which may lead to another minimum.
  [[nodiscard]] std::vector<std::vector<VectorXd>> all() {
    std::vector<std::vector<VectorXd>> families;
    if (orders_.f > 0) {
      output_error();
      families.push_back(std::move(starts_));
      starts_.clear();
      for (const VectorXd& start : families[0]) {
        add_noise(start);
      }
      families.push_back(std::move(starts_));
      starts_.clear();
    }
    if (orders_.f == 0 || orders_.a > 0) {
      extended();
      families.push_back(std::move(starts_));
    }
    return families;
  }

 private:
  /// ARX with A for F, then Steiglitz and McBride: the same with y and u through 1/F.
  void output_error() {
    VectorXd y = record_.y;
    std::vector<VectorXd> u = u_;
    for (int step = 0; step < 12; ++step) {
      std::vector<Lagged> columns{{&y, 1, orders_.f, -1.0}};
      for (const VectorXd& input : u) {
        columns.push_back({&input, orders_.delay, orders_.b, 1.0});
      }
      const auto found = regress(columns, y, first_);
      if (!found || !found->allFinite()) {
        return;
      }
      VectorXd F = VectorXd::Ones(orders_.f + 1);
      F.tail(orders_.f) = found->head(orders_.f);
      F = stabilized(F);
      PolynomialModel model;
      for (Index j = 0; j < inputs_; ++j) {
        VectorXd B = VectorXd::Zero(orders_.delay + orders_.b);
        B.tail(orders_.b) = found->segment(orders_.f + j * orders_.b, orders_.b);
        model.B.push_back(B);
        model.F.push_back(F);
      }
      model.A = unit(orders_.a);
      model.C = unit(orders_.c);
      model.D = unit(orders_.d);
      starts_.push_back(pack(model, orders_));
      filter(VectorXd::Ones(1), F, record_.y, y);
      for (Index j = 0; j < inputs_; ++j) {
        filter(VectorXd::Ones(1), F, u_[static_cast<std::size_t>(j)],
               u[static_cast<std::size_t>(j)]);
      }
    }
  }

  /// C and D of what an output error model leaves, by a long AR model of it.
  void add_noise(const VectorXd& start) {
    if (orders_.c == 0 && orders_.d == 0) {
      return;
    }
    PolynomialModel model = unpack(start, orders_, inputs_);
    const PolynomialModel plain{.A = model.A, .B = model.B, .F = model.F};
    const VectorXd v = prediction_errors(plain, record_.u, record_.y);
    const auto e = innovations({}, v);
    if (!e) {
      return;
    }
    const auto found =
        regress({{&v, 1, orders_.d, -1.0}, {&*e, 1, orders_.c, 1.0}}, v, first_ + orders_.d);
    if (found && found->allFinite()) {
      model.D.tail(orders_.d) = found->head(orders_.d);
      model.C.tail(orders_.c) = found->tail(orders_.c);
      model.C = stabilized(model.C);
      starts_.push_back(pack(model, orders_));
    }
  }

  /// Hannan and Rissanen: the noise by a long ARX model, then a regression on it too.
  void extended() {
    const auto e = innovations(u_, record_.y);
    if (!e) {
      return;
    }
    for (const bool with_noise : {true, false}) {
      std::vector<Lagged> columns{{&record_.y, 1, orders_.a, -1.0}};
      for (const VectorXd& input : u_) {
        columns.push_back({&input, orders_.delay, orders_.b, 1.0});
      }
      if (with_noise) {
        columns.push_back({&*e, 1, orders_.c, 1.0});
      }
      const auto found = regress(columns, record_.y, first_);
      if (!found || !found->allFinite()) {
        continue;
      }
      VectorXd start = VectorXd::Zero(parameters_of(orders_, inputs_));
      start.head(found->size()) = *found;
      starts_.push_back(start);
    }
  }

  /// e of a long (AR)X model.
  [[nodiscard]] std::optional<VectorXd> innovations(const std::vector<VectorXd>& inputs,
                                                    const VectorXd& y) const {
    const Index wanted = 2 * (orders_.a + orders_.b + orders_.c + orders_.d + orders_.f) + 10;
    const Index affordable = y.size() / (4 * (static_cast<Index>(inputs.size()) + 1));
    const Index order = std::max<Index>(1, std::min(wanted, affordable));
    std::vector<Lagged> columns{{&y, 1, order, -1.0}};
    for (const VectorXd& input : inputs) {
      columns.push_back({&input, orders_.delay, order, 1.0});
    }
    const auto found = regress(columns, y, order);
    if (!found || !found->allFinite()) {
      return std::nullopt;
    }
    VectorXd e = y;
    VectorXd part;
    VectorXd polynomial = VectorXd::Ones(order + 1);
    polynomial.tail(order) = found->head(order);
    filter(polynomial, VectorXd::Ones(1), y, e);
    for (std::size_t j = 0; j < inputs.size(); ++j) {
      VectorXd B = VectorXd::Zero(orders_.delay + order);
      B.tail(order) = found->segment(order * (static_cast<Index>(j) + 1), order);
      filter(B, VectorXd::Ones(1), inputs[j], part);
      e -= part;
    }
    return e;
  }

  [[nodiscard]] static VectorXd unit(Index order) {
    VectorXd polynomial = VectorXd::Zero(order + 1);
    polynomial(0) = 1.0;
    return polynomial;
  }

  const ScaledRecord& record_;
  PolynomialOrders orders_;
  Index inputs_;
  Index first_;
  std::vector<VectorXd> u_;
  std::vector<VectorXd> starts_;
};

}  // namespace

std::vector<std::vector<VectorXd>> starts_of(const ScaledRecord& record,
                                             const PolynomialOrders& orders) {
  return Starts(record, orders).all();
}

}  // namespace flyball::identification
