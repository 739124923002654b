#include <algorithm>
#include <cmath>
#include <limits>

#include "optimization/solver/interior_point.hpp"
#include "optimization/solver/restoration.hpp"

namespace flyball::optimization::detail {

namespace {

using Eigen::Index;
using Eigen::VectorXd;

constexpr double rho = 1000.0;

}  // namespace

RestorationProgram::RestorationProgram(Program& program)
    : program_(program), n_(program.variables()), m_(program.constraints()) {
  constraint_count = m_;
  lower.setZero(n_ + 2 * m_);
  upper.setConstant(n_ + 2 * m_, std::numeric_limits<double>::infinity());
  for (VectorXd* v : {&reference_, &weight_, &part_, &part_gradient_, &diagonal_, &rw_, &dw_}) {
    v->setZero(n_);
  }
  for (VectorXd* v : {&D_, &rc_, &dl_, &sigma_p_, &sigma_n_}) {
    v->setZero(m_);
  }
}

void RestorationProgram::set_reference(const VectorXd& w, double mu) {
  lower.head(n_) = program_.lower;
  upper.head(n_) = program_.upper;
  reference_ = w;
  weight_ = w.cwiseAbs().cwiseMax(1.0).array().square().inverse().matrix();
  zeta_ = std::sqrt(mu);
}

void RestorationProgram::begin(const VectorXd& w, const VectorXd& c, double mu, const VectorXd& zl,
                               const VectorXd& zu, InteriorPoint& solver) {
  VectorXd& all = solver.w_;
  all.head(n_) = w;
  // p - n = c and the barrier's first-order conditions in p and n: the section's equation (33).
  for (Index i = 0; i < m_; ++i) {
    const double a = (mu - rho * c(i)) / (2.0 * rho);
    const double n = a + std::sqrt(a * a + mu * c(i) / (2.0 * rho));
    const double positive = std::max(n, 1e-16);
    all(n_ + m_ + i) = positive;
    all(n_ + i) = std::max(c(i) + positive, 1e-16);
  }
  solver.free_.setOnes();
  for (Index i = 0; i < n_; ++i) {
    solver.free_(i) = lower(i) == upper(i) ? 0.0 : 1.0;
  }
  solver.lambda_.setZero();
  solver.zl_.head(n_) = zl.cwiseMin(rho);
  solver.zu_.head(n_) = zu.cwiseMin(rho);
  solver.zl_.tail(2 * m_) = (mu / all.tail(2 * m_).array()).matrix();
  solver.zu_.tail(2 * m_).setZero();
  solver.mu_ = mu;
}

bool RestorationProgram::values(const VectorXd& w, double& f, VectorXd& c) {
  part_ = w.head(n_);
  double ignored = 0.0;
  if (!program_.values(part_, ignored, c)) {
    return false;
  }
  c += w.tail(m_) - w.segment(n_, m_);
  f = rho * w.tail(2 * m_).sum() +
      0.5 * zeta_ * (weight_.array() * (part_ - reference_).array().square()).sum();
  return std::isfinite(f);
}

bool RestorationProgram::derivatives(const VectorXd& w, const VectorXd& lambda, double objective,
                                     VectorXd& gradient) {
  part_ = w.head(n_);
  if (!program_.derivatives(part_, lambda, 0.0, part_gradient_)) {
    return false;
  }
  gradient.head(n_) = (objective * zeta_ * weight_.array() * (part_ - reference_).array()).matrix();
  gradient.tail(2 * m_).setConstant(objective * rho);
  return true;
}

void RestorationProgram::multiply(const VectorXd& dw, const VectorXd& dl, VectorXd& out_w,
                                  VectorXd& out_c) {
  part_ = dw.head(n_);
  program_.multiply(part_, dl, part_gradient_, out_c);
  out_w.head(n_) = part_gradient_ + (zeta_ * weight_.array() * part_.array()).matrix();
  out_w.segment(n_, m_) = -dl;
  out_w.tail(m_) = dl;
  out_c += dw.tail(m_) - dw.segment(n_, m_);
}

void RestorationProgram::transpose_multiply(const VectorXd& lambda, VectorXd& out) {
  program_.transpose_multiply(lambda, part_gradient_);
  out.head(n_) = part_gradient_;
  out.segment(n_, m_) = -lambda;
  out.tail(m_) = lambda;
}

bool RestorationProgram::factor(const VectorXd& diagonal, const VectorXd& D, bool with_hessian) {
  sigma_p_ = diagonal.segment(n_, m_);
  sigma_n_ = diagonal.tail(m_);
  D_ = (D.array() + sigma_p_.array().inverse() + sigma_n_.array().inverse()).matrix();
  diagonal_ = (diagonal.head(n_).array() + zeta_ * weight_.array()).matrix();
  return program_.factor(diagonal_, D_, with_hessian);
}

void RestorationProgram::solve(const VectorXd& rw, const VectorXd& rc, VectorXd& dw, VectorXd& dl) {
  rw_ = rw.head(n_);
  const auto rp = rw.segment(n_, m_).array();
  const auto rn = rw.tail(m_).array();
  rc_ = (rc.array() + rp / sigma_p_.array() - rn / sigma_n_.array()).matrix();
  program_.solve(rw_, rc_, dw_, dl);
  dw.head(n_) = dw_;
  dw.segment(n_, m_) = ((dl.array() - rp) / sigma_p_.array()).matrix();
  dw.tail(m_) = (-(dl.array() + rn) / sigma_n_.array()).matrix();
}

}  // namespace flyball::optimization::detail
