#pragma once

#include <vector>

#include <Eigen/Core>

#include <flyball/identification/polynomial_model.hpp>

/// What the fits of polynomial models share.
namespace flyball::identification {

/// y = b(q)/a(q) x from rest; a(0) = 1.
void filter(const Eigen::VectorXd& b, const Eigen::VectorXd& a, const Eigen::VectorXd& x,
            Eigen::VectorXd& y);

/// The polynomial with its roots outside the circle of radius 1 - 1e-6 reflected into it.
[[nodiscard]] Eigen::VectorXd stabilized(const Eigen::VectorXd& polynomial);

/// e of the model over a whole record from rest: D/C (A y - Σ B_j/F_j u_j).
[[nodiscard]] Eigen::VectorXd prediction_errors(const PolynomialModel& model,
                                                const Eigen::MatrixXd& u, const Eigen::VectorXd& y);

/// d parameters as a model and back.
[[nodiscard]] PolynomialModel unpack(const Eigen::VectorXd& parameters,
                                     const PolynomialOrders& orders, Eigen::Index inputs);
[[nodiscard]] Eigen::VectorXd pack(const PolynomialModel& model, const PolynomialOrders& orders);
[[nodiscard]] Eigen::Index parameters_of(const PolynomialOrders& orders, Eigen::Index inputs);
/// How many samples the longest memory of y or u needs before the first one that counts.
[[nodiscard]] Eigen::Index start_of(const PolynomialOrders& orders);

/// A record in units in which y and each u are about 1.
struct ScaledRecord {
  Eigen::MatrixXd u;
  Eigen::VectorXd y;
  Eigen::VectorXd u_unit;
  double y_unit = 1.0;
};
[[nodiscard]] Expected<ScaledRecord> scaled_record(const MatrixRef& u, const MatrixRef& y,
                                                   Time period, const PolynomialOrders& orders,
                                                   std::string_view where);

/// Parameters by linear regressions, where a search begins: in families, each of which may lead to
/// another minimum.
[[nodiscard]] std::vector<std::vector<Eigen::VectorXd>> starts_of(const ScaledRecord& record,
                                                                  const PolynomialOrders& orders);

/// Everything of a fit that follows from its model and covariance, in the record's own units.
/// @param fit  With orders, parameters, covariance, standard errors in the scaled units.
void finish(PolynomialFit& fit, const ScaledRecord& record, Time period);

}  // namespace flyball::identification
