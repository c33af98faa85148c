// The names of the encodings of images, and what each means.
// SPDX-License-Identifier: Apache-2.0
#ifndef SENSOR_MSGS__IMAGE_ENCODINGS_HPP_
#define SENSOR_MSGS__IMAGE_ENCODINGS_HPP_

#include <cstdlib>
#include <stdexcept>
#include <string>

namespace sensor_msgs::image_encodings {

inline constexpr char RGB8[] = "rgb8";
inline constexpr char RGBA8[] = "rgba8";
inline constexpr char RGB16[] = "rgb16";
inline constexpr char RGBA16[] = "rgba16";
inline constexpr char BGR8[] = "bgr8";
inline constexpr char BGRA8[] = "bgra8";
inline constexpr char BGR16[] = "bgr16";
inline constexpr char BGRA16[] = "bgra16";
inline constexpr char MONO8[] = "mono8";
inline constexpr char MONO16[] = "mono16";

// As OpenCV names its types.
inline constexpr char TYPE_8UC1[] = "8UC1";
inline constexpr char TYPE_8UC2[] = "8UC2";
inline constexpr char TYPE_8UC3[] = "8UC3";
inline constexpr char TYPE_8UC4[] = "8UC4";
inline constexpr char TYPE_8SC1[] = "8SC1";
inline constexpr char TYPE_8SC2[] = "8SC2";
inline constexpr char TYPE_8SC3[] = "8SC3";
inline constexpr char TYPE_8SC4[] = "8SC4";
inline constexpr char TYPE_16UC1[] = "16UC1";
inline constexpr char TYPE_16UC2[] = "16UC2";
inline constexpr char TYPE_16UC3[] = "16UC3";
inline constexpr char TYPE_16UC4[] = "16UC4";
inline constexpr char TYPE_16SC1[] = "16SC1";
inline constexpr char TYPE_16SC2[] = "16SC2";
inline constexpr char TYPE_16SC3[] = "16SC3";
inline constexpr char TYPE_16SC4[] = "16SC4";
inline constexpr char TYPE_32SC1[] = "32SC1";
inline constexpr char TYPE_32SC2[] = "32SC2";
inline constexpr char TYPE_32SC3[] = "32SC3";
inline constexpr char TYPE_32SC4[] = "32SC4";
inline constexpr char TYPE_32FC1[] = "32FC1";
inline constexpr char TYPE_32FC2[] = "32FC2";
inline constexpr char TYPE_32FC3[] = "32FC3";
inline constexpr char TYPE_32FC4[] = "32FC4";
inline constexpr char TYPE_64FC1[] = "64FC1";
inline constexpr char TYPE_64FC2[] = "64FC2";
inline constexpr char TYPE_64FC3[] = "64FC3";
inline constexpr char TYPE_64FC4[] = "64FC4";

inline constexpr char BAYER_RGGB8[] = "bayer_rggb8";
inline constexpr char BAYER_BGGR8[] = "bayer_bggr8";
inline constexpr char BAYER_GBRG8[] = "bayer_gbrg8";
inline constexpr char BAYER_GRBG8[] = "bayer_grbg8";
inline constexpr char BAYER_RGGB16[] = "bayer_rggb16";
inline constexpr char BAYER_BGGR16[] = "bayer_bggr16";
inline constexpr char BAYER_GBRG16[] = "bayer_gbrg16";
inline constexpr char BAYER_GRBG16[] = "bayer_grbg16";

inline constexpr char UYVY[] = "uyvy";
inline constexpr char YUV422[] = "yuv422";
inline constexpr char YUYV[] = "yuyv";
inline constexpr char YUV422_YUY2[] = "yuv422_yuy2";
inline constexpr char NV21[] = "nv21";
inline constexpr char NV24[] = "nv24";

inline bool isPlanar(const std::string& encoding) {
  return encoding == NV21 || encoding == NV24;
}
inline bool isColor(const std::string& encoding) {
  return encoding.starts_with("rgb") || encoding.starts_with("bgr") || isPlanar(encoding) ||
         encoding == UYVY || encoding == YUV422 || encoding == YUYV || encoding == YUV422_YUY2;
}
inline bool isMono(const std::string& encoding) {
  return encoding == MONO8 || encoding == MONO16;
}
inline bool isBayer(const std::string& encoding) {
  return encoding.starts_with("bayer_");
}
inline bool hasAlpha(const std::string& encoding) {
  return encoding.starts_with("rgba") || encoding.starts_with("bgra");
}

/// Throws std::runtime_error if the encoding is unknown.
inline int numChannels(const std::string& encoding) {
  if (isMono(encoding) || isBayer(encoding)) return 1;
  if (isPlanar(encoding) || encoding == UYVY || encoding == YUV422 || encoding == YUYV ||
      encoding == YUV422_YUY2) {
    return 2;
  }
  if (hasAlpha(encoding)) return 4;
  if (isColor(encoding)) return 3;
  // "32FC3" has three channels, "32FC" has one.
  const std::size_t c = encoding.find('C');
  if (c == std::string::npos || c < 2) {
    throw std::runtime_error("Unknown encoding " + encoding);
  }
  return c + 1 == encoding.size() ? 1 : std::atoi(encoding.c_str() + c + 1);
}

/// Bits of one channel. Throws std::runtime_error if the encoding is unknown.
inline int bitDepth(const std::string& encoding) {
  if (encoding == UYVY || encoding == YUV422 || encoding == YUYV || encoding == YUV422_YUY2 ||
      isPlanar(encoding)) {
    return 8;
  }
  if (isColor(encoding) || isMono(encoding) || isBayer(encoding)) {
    return encoding.ends_with("16") ? 16 : 8;
  }
  const int bits = std::atoi(encoding.c_str());
  if (bits == 0) throw std::runtime_error("Unknown encoding " + encoding);
  return bits;
}

}  // namespace sensor_msgs::image_encodings

#endif  // SENSOR_MSGS__IMAGE_ENCODINGS_HPP_
