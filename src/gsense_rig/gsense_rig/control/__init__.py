"""Control of the carriage: model, references, controllers, estimators. Pure: no ROS, no clock, no hardware."""
