"""The service: phones upload walks, the map grows, everybody is positioned.

``app.create_app`` makes the application; ``replay`` plays recorded walks against it as phones would.
"""
