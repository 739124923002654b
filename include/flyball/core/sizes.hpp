#pragma once

#include <Eigen/Core>

namespace flyball {

/// Two matrix types that no values can make equal in shape. Overloads for it are deleted where a
/// run-time object takes vectors, so that the compiler names the call, not a line inside Eigen.
template <class Given, class Wanted>
concept wrong_size =
    (Given::RowsAtCompileTime != Eigen::Dynamic && Wanted::RowsAtCompileTime != Eigen::Dynamic &&
     int{Given::RowsAtCompileTime} != int{Wanted::RowsAtCompileTime}) ||
    (Given::ColsAtCompileTime != Eigen::Dynamic && Wanted::ColsAtCompileTime != Eigen::Dynamic &&
     int{Given::ColsAtCompileTime} != int{Wanted::ColsAtCompileTime});

}  // namespace flyball
