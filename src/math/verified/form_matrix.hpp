#pragma once

#include <array>
#include <optional>
#include <vector>

#include <Eigen/Core>

#include "math/verified/taylor_form.hpp"

namespace flyball::detail {

/// A matrix whose entries are known over a box of parameters.
class FormMatrix {
 public:
  FormMatrix() = default;
  FormMatrix(Eigen::Index rows, Eigen::Index columns)
      : rows_(rows), columns_(columns), entries_(static_cast<std::size_t>(rows * columns)) {}
  explicit FormMatrix(const Eigen::MatrixXd& exact);
  [[nodiscard]] static FormMatrix identity(Eigen::Index size);

  [[nodiscard]] Eigen::Index rows() const noexcept { return rows_; }
  [[nodiscard]] Eigen::Index cols() const noexcept { return columns_; }
  [[nodiscard]] TaylorForm& operator()(Eigen::Index i, Eigen::Index j) noexcept {
    return entries_[static_cast<std::size_t>(i * columns_ + j)];
  }
  [[nodiscard]] const TaylorForm& operator()(Eigen::Index i, Eigen::Index j) const noexcept {
    return entries_[static_cast<std::size_t>(i * columns_ + j)];
  }
  [[nodiscard]] FormMatrix block(Eigen::Index i, Eigen::Index j, Eigen::Index rows,
                                 Eigen::Index columns) const;

 private:
  Eigen::Index rows_ = 0;
  Eigen::Index columns_ = 0;
  std::vector<TaylorForm> entries_;
};

[[nodiscard]] FormMatrix operator*(const FormMatrix& A, const FormMatrix& B);
[[nodiscard]] FormMatrix operator*(const TaylorForm& factor, FormMatrix A);
[[nodiscard]] FormMatrix operator+(FormMatrix A, const FormMatrix& B);
[[nodiscard]] FormMatrix operator-(FormMatrix A, const FormMatrix& B);

/// e^H by its series after halving, and squaring; the rest of the series is in the radii. Nothing
/// where H is too large for the radii to stay finite.
[[nodiscard]] std::optional<FormMatrix> exponential(const FormMatrix& H);

/// E⁻¹ F by elimination after multiplication by an approximate inverse of E's centre; nothing where
/// a member of E may be singular.
[[nodiscard]] std::optional<FormMatrix> solve(const FormMatrix& E, const FormMatrix& F);

/// {centre + Σ ε_i slopes_i + Σ σ_k squares_k + G : |ε_i| <= 1, |σ_k| <= 1, |G| <= radius}, the
/// last entry by entry: squares move with their parameters, but are taken to move by themselves.
struct MatrixFamily {
  Eigen::MatrixXd centre;
  std::vector<Eigen::MatrixXd> slopes;  ///< Those of the parameters that matter.
  std::vector<int> parameters;          ///< Which each of them is.
  std::vector<Eigen::MatrixXd> squares;
  std::vector<std::array<int, 2>> pairs;  ///< Of parameters, one for each square.
  Eigen::MatrixXd radius;

  /// centre + Σ ±slopes: bit i of `signs` set takes + for slopes[i].
  [[nodiscard]] Eigen::MatrixXd vertex(unsigned signs) const;
  [[nodiscard]] unsigned vertices() const noexcept { return 1u << slopes.size(); }
};
[[nodiscard]] MatrixFamily family_of(const FormMatrix& A);

}  // namespace flyball::detail
