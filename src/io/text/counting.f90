! SPDX-License-Identifier: MIT
!> Equalities of counts that distinguish geometry files from analysis files, and the two dialects.
!>
!> Geometry: N = 9 + 5 lines + 5 material lines + k bolts + 4 fixed lines + 2 (loading + measured + hole points),
!> k = 4 or 7. Analysis: R = N - 6 - 13 block materials - 3 joint materials is 0 or 1 (dialect dda_windows) or, with
!> P fixed and loading points and M rows of time-dependent values, 2 + P + 3M or 1 + P + 3M (dialect g0).
module rockdda_io_counting
   use rockdda_base_kinds, only : wp, i8
   use rockdda_io_tokens, only : token_list_type
   use rockdda_base_numbers, only : is_whole
   implicit none
   private
   public :: geometry_needs, analysis_needs, fits_geometry, fits_analysis, plain_numbers, g0_points_fit, find_g0_points

contains

   !> Numbers that a geometry file must have.
   pure integer(i8) function geometry_needs(counts, per_bolt)
      integer, intent(in) :: counts(8)  !! lines, boundary lines, material lines, bolts, fixed, loading, measured, holes
      integer, intent(in) :: per_bolt   !! 4 or 7
      integer(i8) :: n(8)
      n = int(counts, i8)
      geometry_needs = 9 + 5*n(1) + 5*n(3) + per_bolt*n(4) + 4*n(5) + 2*(n(6) + n(7) + n(8))
   end function geometry_needs

   !> Numbers that an analysis file of dialect dda_windows must have, without SOR factor.
   pure integer(i8) function analysis_needs(n_block_materials, n_joint_materials)
      integer, intent(in) :: n_block_materials, n_joint_materials
      analysis_needs = 6 + 13*int(n_block_materials, i8) + 3*int(n_joint_materials, i8)
   end function analysis_needs

   !> The numbers of a file without comments: on each line those before its first text.
   pure function plain_numbers(tokens) result(values)
      type(token_list_type), intent(in) :: tokens
      real(wp), allocatable :: values(:)
      values = tokens%value(tokens%number_places())
   end function plain_numbers

   !> Does the equality of a geometry file hold?
   pure logical function fits_geometry(tokens)
      type(token_list_type), intent(in) :: tokens
      real(wp), allocatable :: values(:)
      integer :: k
      fits_geometry = .false.
      if (tokens%n_numbers < 9) return
      values = plain_numbers(tokens)
      do k = 2, 9
         if (.not. is_whole(values(k)) .or. values(k) < 0) return
      end do
      fits_geometry = geometry_needs(nint(values(2:9)), 4) == tokens%n_numbers .or. &
                      geometry_needs(nint(values(2:9)), 7) == tokens%n_numbers
   end function fits_geometry

   !> Does one of the equalities of an analysis file hold?
   pure logical function fits_analysis(tokens)
      type(token_list_type), intent(in) :: tokens
      real(wp), allocatable :: values(:)
      integer(i8) :: rest
      integer :: k, n_found, first, second
      fits_analysis = .false.
      if (tokens%n_numbers < 6) return
      values = plain_numbers(tokens)
      do k = 2, 4
         if (.not. is_whole(values(k)) .or. values(k) < 0) return
      end do
      if (values(3) < 1) return
      rest = tokens%n_numbers - analysis_needs(nint(values(3)), nint(values(4)))
      if (rest == 0 .or. rest == 1) then
         fits_analysis = .true.
      else if (rest > 1) then
         call find_g0_points(values, int(rest), n_found, first, second)
         fits_analysis = n_found > 0
      end if
   end function fits_analysis

   !> Does the equality of dialect g0 hold for this number of fixed and loading points?
   pure logical function g0_points_fit(values, rest, n_points)
      real(wp), intent(in) :: values(:)     !! numbers of the file
      integer, intent(in) :: rest           !! R
      integer, intent(in) :: n_points       !! P
      integer(i8) :: rows
      integer :: k
      g0_points_fit = .false.
      if (n_points < 0 .or. n_points + 1 > rest .or. 7 + n_points > size(values)) return
      rows = 0
      do k = 8, 7 + n_points
         if (.not. is_whole(values(k)) .or. values(k) < 0) return
         rows = rows + nint(values(k))
      end do
      g0_points_fit = rest == 2 + n_points + 3*rows .or. rest == 1 + n_points + 3*rows
   end function g0_points_fit

   !> Find the numbers of points for which the equality of dialect g0 holds.
   pure subroutine find_g0_points(values, rest, n_found, first, second)
      real(wp), intent(in) :: values(:)     !! numbers of the file
      integer, intent(in) :: rest           !! R
      integer, intent(out) :: n_found
      integer, intent(out) :: first, second !! the smallest two, -1 where there is none
      integer(i8) :: rows
      integer :: p
      n_found = 0
      first = -1
      second = -1
      rows = 0
      p = 0
      do while (1 + p + 3*rows <= rest)
         if (rest == 2 + p + 3*rows .or. rest == 1 + p + 3*rows) then
            n_found = n_found + 1
            if (n_found == 1) first = p
            if (n_found == 2) second = p
         end if
         p = p + 1
         if (7 + p > size(values)) exit
         if (.not. is_whole(values(7 + p)) .or. values(7 + p) < 0) exit
         rows = rows + nint(values(7 + p))
      end do
   end subroutine find_g0_points

end module rockdda_io_counting
