#include <flyball/study/model_job.hpp>

namespace flyball::study {

InputSignals::InputSignals(expression::Tape tape, std::vector<double> parameters)
    : tape_(std::move(tape)), prepared_(tape_.size()) {
  tape_.prepare<double>(parameters, prepared_);
}

Eigen::VectorXd InputSignals::operator()(double t) const {
  std::vector<double> values = prepared_;
  Eigen::VectorXd u(static_cast<Eigen::Index>(tape_.outputs()));
  tape_.evaluate<double>({&t, 1}, {u.data(), tape_.outputs()}, values);
  return u;
}

}  // namespace flyball::study
