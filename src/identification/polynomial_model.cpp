#include <flyball/identification/polynomial_model.hpp>

#include <algorithm>
#include <string>

#include <flyball/core/argument.hpp>

#include "core/try.hpp"

namespace flyball::identification {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

namespace {

/// Several numerators over one monic denominator, in observer form.
struct Block {
  MatrixXd A;
  MatrixXd B;  ///< n x numerators.
  Eigen::RowVectorXd direct;
};

Block observer(const VectorXd& denominator, const std::vector<VectorXd>& numerators) {
  Index n = denominator.size() - 1;
  for (const VectorXd& numerator : numerators) {
    n = std::max(n, numerator.size() - 1);
  }
  VectorXd a = VectorXd::Zero(n + 1);
  a.head(denominator.size()) = denominator;
  Block block{MatrixXd::Zero(n, n), MatrixXd(n, static_cast<Index>(numerators.size())),
              Eigen::RowVectorXd(static_cast<Index>(numerators.size()))};
  if (n > 0) {
    block.A.col(0) = -a.tail(n);
    block.A.diagonal(1).setOnes();
  }
  for (std::size_t j = 0; j < numerators.size(); ++j) {
    VectorXd b = VectorXd::Zero(n + 1);
    b.head(numerators[j].size()) = numerators[j];
    const auto column = static_cast<Index>(j);
    block.direct(column) = b(0);
    block.B.col(column) = b.tail(n) - a.tail(n) * b(0);
  }
  return block;
}

/// Below the states so far: x⁺ = A x + B w, with v = first of x + direct w added to the sum.
class Parallel {
 public:
  explicit Parallel(Index inputs) : direct(Eigen::RowVectorXd::Zero(inputs)), inputs_(inputs) {}

  /// @param columns  Which of the inputs are those of the block.
  void add(const Block& block, const std::vector<Index>& columns) {
    const Index old = A.rows();
    const Index n = block.A.rows();
    A.conservativeResizeLike(MatrixXd::Zero(old + n, old + n));
    A.bottomRightCorner(n, n) = block.A;
    B.conservativeResizeLike(MatrixXd::Zero(old + n, inputs_));
    C.conservativeResizeLike(Eigen::RowVectorXd::Zero(old + n));
    for (std::size_t j = 0; j < columns.size(); ++j) {
      B.col(columns[j]).tail(n) = block.B.col(static_cast<Index>(j));
      direct(columns[j]) += block.direct(static_cast<Index>(j));
    }
    if (n > 0) {
      C(old) = 1.0;
    }
  }

  MatrixXd A;
  MatrixXd B;
  Eigen::RowVectorXd C;
  Eigen::RowVectorXd direct;

 private:
  Index inputs_;
};

}  // namespace

Expected<InnovationsModel> to_state_space(const PolynomialModel& model) {
  constexpr std::string_view where = "to_state_space";
  const auto m = static_cast<Index>(model.B.size());
  if (m == 0 || model.F.size() != model.B.size()) {
    return refusal(m == 0 ? ArgumentError::empty : ArgumentError::wrong_shape, where, "the model")
        .got(std::to_string(model.B.size()) + " polynomials B and " +
             std::to_string(model.F.size()) + " F")
        .expected("one of each for every input");
  }
  std::vector<const VectorXd*> monic{&model.A, &model.C, &model.D};
  for (const VectorXd& F : model.F) {
    monic.push_back(&F);
  }
  for (const VectorXd* polynomial : monic) {
    FLYBALL_CHECK(check_finite(*polynomial, where, "a polynomial"));
    if (polynomial->size() == 0 || (*polynomial)(0) != 1.0) {
      return refusal(ArgumentError::malformed, where, "A, C, D or F")
          .got("without a leading 1")
          .expected("1 and the coefficients of q⁻¹, q⁻², …");
    }
  }
  const bool plain =
      model.D.size() == 1 &&
      std::all_of(model.F.begin(), model.F.end(), [](const VectorXd& F) { return F.size() == 1; });
  // v = A y, from the inputs and e, which is the last one.
  Parallel sum(m + 1);
  if (plain) {
    // y = (B u + C e)/A in one observer form.
    std::vector<VectorXd> numerators = model.B;
    numerators.push_back(model.C);
    std::vector<Index> columns;
    for (Index j = 0; j <= m; ++j) {
      columns.push_back(j);
    }
    sum.add(observer(model.A, numerators), columns);
  } else {
    for (Index j = 0; j < m; ++j) {
      const auto at = static_cast<std::size_t>(j);
      sum.add(observer(model.F[at], {model.B[at]}), {j});
    }
    sum.add(observer(model.D, {model.C}), {m});
    if (model.A.size() > 1) {
      const Block last = observer(model.A, {VectorXd::Ones(1)});
      const Index n = last.A.rows();
      const Index old = sum.A.rows();
      sum.A.conservativeResizeLike(MatrixXd::Zero(old + n, old + n));
      sum.A.bottomRightCorner(n, n) = last.A;
      sum.A.bottomLeftCorner(n, old) = last.B * sum.C;
      sum.B.conservativeResizeLike(MatrixXd::Zero(old + n, m + 1));
      sum.B.bottomRows(n) = last.B * sum.direct;
      sum.C.conservativeResizeLike(Eigen::RowVectorXd::Zero(old + n));
      sum.C(old) = 1.0;
    }
  }
  const Index n = std::max<Index>(1, sum.A.rows());
  InnovationsModel result;
  result.system = {MatrixXd::Zero(n, n), MatrixXd::Zero(n, m), MatrixXd::Zero(1, n),
                   sum.direct.head(m), model.period};
  result.K = MatrixXd::Zero(n, 1);
  if (sum.A.rows() > 0) {
    result.system.A = sum.A;
    result.system.B = sum.B.leftCols(m);
    result.system.C = sum.C;
    result.K = sum.B.col(m);
  }
  result.noise = MatrixXd::Constant(1, 1, model.noise);
  result.x0 = VectorXd::Zero(n);
  return result;
}

}  // namespace flyball::identification
