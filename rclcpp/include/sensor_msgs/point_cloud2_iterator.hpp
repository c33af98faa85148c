// Fields and points of a PointCloud2.
// SPDX-License-Identifier: Apache-2.0
#ifndef SENSOR_MSGS__POINT_CLOUD2_ITERATOR_HPP_
#define SENSOR_MSGS__POINT_CLOUD2_ITERATOR_HPP_

#include <cstdarg>
#include <cstddef>
#include <cstdint>
#include <stdexcept>
#include <string>
#include <type_traits>

#include "sensor_msgs/msg/point_cloud2.hpp"

namespace sensor_msgs {

/// Bytes of a PointField's datatype.
inline int sizeOfPointField(int datatype) {
  using Field = msg::PointField;
  switch (datatype) {
    case Field::INT8:
    case Field::UINT8:
      return 1;
    case Field::INT16:
    case Field::UINT16:
      return 2;
    case Field::INT32:
    case Field::UINT32:
    case Field::FLOAT32:
      return 4;
    case Field::FLOAT64:
      return 8;
    default:
      throw std::runtime_error("PointField of type " + std::to_string(datatype) +
                               " does not exist");
  }
}

/// Sets the fields of a cloud, and the number of its points.
/// Thread safety: none. Real-time: allocates.
class PointCloud2Modifier {
 public:
  explicit PointCloud2Modifier(msg::PointCloud2& cloud) : cloud_(cloud) {}

  std::size_t size() const {
    return cloud_.point_step == 0 ? 0 : cloud_.data.size() / cloud_.point_step;
  }
  void reserve(std::size_t points) { cloud_.data.reserve(points * cloud_.point_step); }
  /// An organized cloud keeps its height if `points` is a multiple of the height.
  void resize(std::size_t points) {
    if (cloud_.height == 0 || points % cloud_.height != 0) cloud_.height = 1;
    cloud_.width = static_cast<std::uint32_t>(points / cloud_.height);
    set_rows();
  }
  void clear() {
    cloud_.data.clear();
    cloud_.height = 1;
    cloud_.width = 0;
    cloud_.row_step = 0;
  }

  /// `count` fields, each as name, count and datatype: `(2, "x", 1, PointField::FLOAT32, …)`. The
  /// fields are packed without padding.
  void setPointCloud2Fields(int count, ...) {
    cloud_.fields.clear();
    std::uint32_t offset = 0;
    va_list fields;
    va_start(fields, count);
    for (int i = 0; i < count; ++i) {
      const char* const name = va_arg(fields, const char*);
      const int elements = va_arg(fields, int);
      offset = add_field(name, elements, va_arg(fields, int), offset);
    }
    va_end(fields);
    cloud_.point_step = offset;
    set_rows();
  }
  /// Names of groups of fields: "xyz", "rgb" or "rgba", each of which takes 16 bytes. Throws
  /// std::runtime_error for any other name.
  void setPointCloud2FieldsByString(int count, ...) {
    cloud_.fields.clear();
    std::uint32_t offset = 0;
    va_list names;
    va_start(names, count);
    for (int i = 0; i < count; ++i) {
      const std::string name = va_arg(names, const char*);
      if (name == "xyz") {
        for (const char* const axis : {"x", "y", "z"}) {
          offset = add_field(axis, 1, msg::PointField::FLOAT32, offset);
        }
        offset += 4;
      } else if (name == "rgb" || name == "rgba") {
        offset = add_field(name, 1, msg::PointField::FLOAT32, offset) + 12;
      } else {
        va_end(names);
        throw std::runtime_error("Field " + name + " does not exist");
      }
    }
    va_end(names);
    cloud_.point_step = offset;
    set_rows();
  }

 private:
  std::uint32_t add_field(const std::string& name, int count, int datatype, std::uint32_t offset) {
    msg::PointField field;
    field.name = name;
    field.count = static_cast<std::uint32_t>(count);
    field.datatype = static_cast<std::uint8_t>(datatype);
    field.offset = offset;
    cloud_.fields.push_back(field);
    return offset + static_cast<std::uint32_t>(count * sizeOfPointField(datatype));
  }
  void set_rows() {
    cloud_.row_step = cloud_.width * cloud_.point_step;
    cloud_.data.resize(std::size_t{cloud_.height} * cloud_.row_step);
  }

  msg::PointCloud2& cloud_;
};

namespace impl {

/// One field of each point: "x", or "r", "g", "b" and "a" inside of "rgb" or "rgba".
/// Thread safety: none. Real-time: yes, once it is made.
template <class T, class Byte, class Cloud, class Derived>
class PointCloud2IteratorBase {
 public:
  PointCloud2IteratorBase() = default;
  PointCloud2IteratorBase(Cloud& cloud, const std::string& field)
      : step_(static_cast<std::ptrdiff_t>(cloud.point_step)),
        at_(cloud.data.data() + offset_of(cloud, field)),
        end_(at_ + cloud.data.size() / (step_ == 0 ? 1 : cloud.point_step) * cloud.point_step) {}

  T& operator*() const { return *reinterpret_cast<T*>(at_); }
  /// The value `number` places further on in this point.
  T& operator[](std::size_t number) const { return *(reinterpret_cast<T*>(at_) + number); }
  Derived& operator++() { return *this += 1; }
  Derived& operator+=(int points) {
    at_ += points * step_;
    return static_cast<Derived&>(*this);
  }
  Derived operator+(int points) const {
    Derived result = static_cast<const Derived&>(*this);
    return result += points;
  }
  bool operator==(const Derived& other) const { return at_ == other.at_; }
  bool operator!=(const Derived& other) const { return at_ != other.at_; }
  Derived end() const {
    Derived result = static_cast<const Derived&>(*this);
    result.at_ = end_;
    return result;
  }

 private:
  static std::size_t offset_of(const Cloud& cloud, const std::string& name) {
    const bool is_colour = name == "r" || name == "g" || name == "b" || name == "a";
    for (const msg::PointField& field : cloud.fields) {
      if (field.name == name) return field.offset;
      if (is_colour && (field.name == "rgb" || field.name == "rgba")) {
        // 0xaarrggbb, in the byte order of the cloud.
        const std::size_t behind_blue = name == "b" ? 0 : name == "g" ? 1 : name == "r" ? 2 : 3;
        return field.offset + (cloud.is_bigendian ? 3 - behind_blue : behind_blue);
      }
    }
    throw std::runtime_error("Field " + name + " does not exist");
  }

  std::ptrdiff_t step_ = 0;
  Byte* at_ = nullptr;
  Byte* end_ = nullptr;
};

}  // namespace impl

template <class T>
struct PointCloud2Iterator
    : impl::PointCloud2IteratorBase<T, unsigned char, msg::PointCloud2, PointCloud2Iterator<T>> {
  using Base =
      impl::PointCloud2IteratorBase<T, unsigned char, msg::PointCloud2, PointCloud2Iterator>;
  using Base::Base;
};

template <class T>
struct PointCloud2ConstIterator
    : impl::PointCloud2IteratorBase<const T, const unsigned char, const msg::PointCloud2,
                                    PointCloud2ConstIterator<T>> {
  using Base = impl::PointCloud2IteratorBase<const T, const unsigned char, const msg::PointCloud2,
                                             PointCloud2ConstIterator>;
  using Base::Base;
};

}  // namespace sensor_msgs

#endif  // SENSOR_MSGS__POINT_CLOUD2_ITERATOR_HPP_
