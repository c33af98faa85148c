# SPDX-License-Identifier: Apache-2.0
ament_index_register_resource(exported_classes CONTENT "${exported_classes}")
