"""The diagnosis of a depth sensor."""
